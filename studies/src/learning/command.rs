//! `quadrant-studies learning`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::Output;
use quadrant_cli::say;
use quadrant_report::{Block, Section};

use super::{changes, cuts, figures, known, parts, recorded, starts};

/// Options of `quadrant-studies learning`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    settings: LawSettings,
    /// Run one question alone.
    #[arg(long, value_enum)]
    only: Option<Question>,
    /// Instead of all that: a recording of EMPS, whose friction then acts on a simulated axis: a CSV file with t_s, position_mm
    /// (or position_m) and voltage_v.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "settings"])]
    record: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// A question of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Question {
    /// Other gains, another history, friction from a catalogue.
    Starts,
    /// Friction that the feedforward knows.
    Known,
    /// Short moves, and a part with reversals of all sizes.
    Parts,
    /// Another tool, an hour of rest.
    Changes,
    /// A cut, with what else may be done about it.
    Cuts,
    /// The figures alone.
    Figures,
}

/// Runs the study on the x axis, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        settings,
        only,
        record,
        output,
    } = arguments;
    if let Some(path) = record {
        say!(
            "Recorded friction on a simulated axis; seed {}\n",
            output.seed
        );
        return output.table(&recorded::table(path, output.seed)?);
    }
    let stage = settings.read()?.stage;
    let axis = &stage.axes[0];
    let seed = output.seed;
    let asked = |question| only.is_none_or(|only| only == question);
    let mut tables = Vec::new();
    if asked(Question::Starts) {
        tables.extend(starts::tables(&stage, axis, seed)?);
    }
    if asked(Question::Known) {
        tables.push(known::table(&stage, axis, seed)?);
    }
    if asked(Question::Parts) {
        tables.push(parts::table(&stage, seed)?);
    }
    if asked(Question::Changes) {
        tables.push(changes::table(&stage, axis, seed)?);
    }
    if asked(Question::Cuts) {
        tables.extend(cuts::table(&stage, axis, seed)?);
        tables.extend(cuts::speeds(&stage, axis, seed)?);
    }
    say!("Simulated, not measured; seed {seed}\n");
    for table in &tables {
        output.table(table)?;
    }
    let mut blocks: Vec<Block> = tables.into_iter().map(Block::Table).collect();
    if asked(Question::Figures) {
        let figures = figures::figures(&stage, axis, seed)?;
        blocks.extend(figures.into_iter().map(Block::Figure));
    }
    output.section(
        "Learning on the simulated stage",
        "The feedforward that learns: other starts, part programs, changes, cuts; simulated, not measured",
        Section {
            id: "results".to_owned(),
            heading: "Results".to_owned(),
            provenance: None,
            prose: vec![],
            blocks,
        },
        "learning.html",
    )
}
