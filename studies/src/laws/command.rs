//! `quadrant-studies laws`.

use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, command_line, share};
use quadrant_cli::say;
use quadrant_pages::parts::provenance;
use quadrant_report::{Block, Page};

use crate::laws::page::laws_section;
use crate::laws::study::run_study;
use crate::wrong_model::page::wrong_model_section;

/// Options of `quadrant-studies laws`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum, default_value_t = Axis::X)]
    axis: Axis,
    #[command(flatten)]
    settings: LawSettings,
    /// Noise seeds of the comparison, from --seed on.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    #[command(flatten)]
    output: Output,
}

/// Steps of the progress bar.
const STEPS: u64 = 1_000_000;

/// Runs the study, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { output, axis, .. } = arguments;
    let stage = arguments.settings.read()?.stage;
    let bar = share("tuning and running the laws");
    bar.set_length(STEPS);
    let study = run_study(
        &stage,
        axis.index(),
        output.seed,
        arguments.seeds,
        &|done| bar.inc((done * STEPS as f64) as u64),
    )?;
    bar.finish_and_clear();
    say!(
        "Simulated, not measured. {} axis, 10 kHz, f32; seeds from {}\n",
        axis.name(),
        output.seed
    );
    let sections = vec![
        laws_section(&study.laws, &study.outcomes),
        wrong_model_section(&study.wrong),
    ];
    for block in sections.iter().flat_map(|section| &section.blocks) {
        if let Block::Table(table) = block {
            output.table(table)?;
        }
    }
    let page = Page {
        title: "Feedback laws at equal robustness".to_owned(),
        subtitle: format!(
            "{} axis of the simulated stage; simulated, not measured",
            axis.name()
        ),
        provenance: provenance(&command_line(), output.seed),
        sections,
    };
    output.page(&page, "laws.html")
}
