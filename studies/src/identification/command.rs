//! `quadrant-studies identification`.

use clap::Args;
use quadrant_cli::output::{Output, progress};

use crate::identification::page::validation_table;
use crate::identification::{NOISE_LEVELS, validate};
use quadrant_cli::say;

/// Options of `quadrant-studies identification`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// Seeds for each axis and noise level.
    #[arg(long, default_value_t = 5)]
    seeds: u64,
    #[command(flatten)]
    output: Output,
}

/// Runs the study, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let runs = 3 * NOISE_LEVELS.len() as u64 * arguments.seeds;
    let bar = progress(runs, "commissioning axes whose truth is hidden");
    let judgements = validate(arguments.seeds, &bar)?;
    bar.finish_and_clear();
    say!("Simulated, not measured.\n");
    arguments.output.tables(
        "Identification judged by the truth",
        "Axes of the simulated stage, whose truth was hidden from identification; simulated, not measured",
        vec![validation_table(&judgements)],
        "validation",
    )
}
