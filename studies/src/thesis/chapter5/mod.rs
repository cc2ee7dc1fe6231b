//! The tables and figures of the thesis' chapter 5, under its numbers and in our words. What it simulated is run
//! here with the exact model, what it measured with the identified one.

mod figures;
mod tables;

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Comparison, Entry};
use quadrant_pages::compare::sine::VELOCITIES_MM_S;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::ModelKnowledge;
use quadrant_report::Section;
use quadrant_sim::metrics::GLITCH_WINDOW;

use super::Context;
use crate::study::Advance;

/// Controllers in the order of the chapter.
const CONTROLLERS: [LawKind; 2] = [LawKind::Pid, LawKind::NPid];

/// Data of the tables and figures.
struct Chapter<'a> {
    comparison: &'a Comparison,
}

impl<'a> Chapter<'a> {
    fn entry(
        &self,
        controller: LawKind,
        feedforward: FeedforwardKind,
        knowledge: ModelKnowledge,
        velocity_mm_s: f64,
    ) -> Option<&'a Entry> {
        self.at(
            AMPLITUDES_MM[0],
            controller,
            feedforward,
            knowledge,
            velocity_mm_s,
        )
    }

    fn at(
        &self,
        amplitude_mm: f64,
        controller: LawKind,
        feedforward: FeedforwardKind,
        knowledge: ModelKnowledge,
        velocity_mm_s: f64,
    ) -> Option<&'a Entry> {
        let configuration = Configuration {
            controller,
            feedforward,
            ..Configuration::PID
        };
        self.comparison
            .find(configuration, knowledge, amplitude_mm, velocity_mm_s)
    }
}

/// The thesis' name and ours.
const fn knowledge_name(knowledge: ModelKnowledge) -> &'static str {
    match knowledge {
        ModelKnowledge::Exact => "simulation (exact model)",
        ModelKnowledge::Identified => "experiment (identified model)",
    }
}

/// Every controller with every feedforward.
pub(super) fn sections(context: &Context, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
    Ok(chapter5_sections(context.comparison(advance)?))
}

/// Tables 5.1 to 5.22 and Figures 5.1 to 5.18; beside PID with each feedforward the best PID alone.
pub fn chapter5_sections(comparison: &Comparison) -> Vec<Section> {
    let chapter = Chapter { comparison };
    let section = |id: &str, heading: &str, prose: Vec<String>, blocks| Section {
        id: format!("chapter-5-{id}"),
        heading: heading.to_owned(),
        provenance: None,
        prose,
        blocks,
    };
    let mut controllers = chapter.controller_tables();
    controllers.extend(chapter.controller_figures());
    let under = |controller, first_table, first_figure| {
        let mut blocks = chapter.feedforward_tables(controller, first_table);
        blocks.extend(chapter.feedforward_figures(controller, first_figure));
        blocks
    };
    let mut amplitudes = chapter.amplitude_tables();
    amplitudes.push(chapter.amplitude_figure());
    vec![
        section(
            "controllers",
            "PID and N-PID without feedforward",
            vec![metrics_prose(), runs_prose(comparison)],
            controllers,
        ),
        section(
            "pid",
            "PID with each feedforward",
            Vec::new(),
            under(LawKind::Pid, 5, 6),
        ),
        section(
            "npid",
            "N-PID with each feedforward",
            Vec::new(),
            under(LawKind::NPid, 10, 12),
        ),
        section(
            "side-by-side",
            "PID and N-PID side by side",
            Vec::new(),
            chapter.side_by_side_tables(),
        ),
        section("amplitudes", "Two amplitudes", Vec::new(), amplitudes),
    ]
}

fn metrics_prose() -> String {
    format!(
        "The x axis follows a sine of {} mm amplitude whose largest velocity is {} mm/s. Tracking error is the \
         reference minus the true position over two cycles, as largest magnitude and as RMS. The glitch of a reversal \
         is the largest error magnitude within {} % of the cycle on either side of it, over the mean error magnitude \
         in the shoulders of the same width next to that window; the mean over the reversals is shown.",
        either(&AMPLITUDES_MM),
        either(&VELOCITIES_MM_S),
        100.0 * GLITCH_WINDOW
    )
}

/// "5, 10 or 15".
fn either(values: &[f64]) -> String {
    match values {
        [] => String::new(),
        [only] => only.to_string(),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(f64::to_string).collect();
            format!("{} or {last}", first.join(", "))
        }
    }
}

fn runs_prose(comparison: &Comparison) -> String {
    let seeds = comparison
        .entries()
        .iter()
        .map(|entry| entry.scores.len())
        .max()
        .unwrap_or_default();
    format!(
        "Both use the same controllers. What the thesis simulated is run here with the exact model: the feedforward has the plant's own \
         friction, and nothing in the run is random, so it is run once and has no spread. What the thesis measured is run here with the identified model: the plant \
         has noise, offset and ripple, and the law has what commissioning it found; means of {seeds} runs, ± is one \
         standard deviation of a run. Both are simulated; nothing here is measured on a machine."
    )
}
