//! Learning of the friction feedforward's scale: from other starts, after a step of friction, in a cut, and beside cancelling
//! with a wrong or changing speed of the spindle.

mod figures;
mod run;
mod spindle;
mod starts;

use clap::{Args, ValueEnum};
use quadrant_cli::law_settings::LawSettings;
use quadrant_report::{Block, Section};

use crate::study::{Advance, Study, results};

/// `quadrant-studies learning`, on the x axis.
#[derive(Clone, Debug, Args)]
pub struct Learning {
    #[command(flatten)]
    settings: LawSettings,
    /// Run one question alone.
    #[arg(long, value_enum)]
    only: Option<Question>,
}

/// A question of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Question {
    /// Other gains, another history, friction from a catalogue.
    Starts,
    /// A cut that is cancelled at another speed than the spindle's.
    Spindle,
    /// The figures alone.
    Figures,
}

impl Study for Learning {
    const NAME: &'static str = "learning";
    const TITLE: &'static str = "Learning on the simulated stage";
    const SUBTITLE: &'static str = "The feedforward that learns: other starts, cuts";

    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let stage = self.settings.read()?.stage;
        let axis = &stage.axes[0];
        let is_asked = |question| self.only.is_none_or(|only| only == question);
        let mut blocks = Vec::new();
        if is_asked(Question::Starts) {
            blocks.extend(starts::tables(&stage, axis, seed)?.map(Block::Table));
        }
        advance(0.5);
        if is_asked(Question::Spindle) {
            blocks.push(Block::Table(spindle::table(&stage, axis, seed)?));
        }
        advance(0.4);
        if is_asked(Question::Figures) {
            blocks.extend(figures::figures(&stage, axis, seed)?.map(Block::Figure));
        }
        Ok(results(blocks))
    }
}
