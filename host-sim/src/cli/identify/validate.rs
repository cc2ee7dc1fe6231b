//! `quadrant identify validate`.

use clap::Args;
use quadrant_sim::experiment::validation::{NOISE_LEVELS, validate};
use quadrant_sim::presentation::validation_table;

use crate::cli::output::{Output, progress};

/// Options of `quadrant identify validate`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// Seeds for each axis and noise level.
    #[arg(long, default_value_t = 5)]
    seeds: u64,
    #[command(flatten)]
    output: Output,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let runs = 3 * NOISE_LEVELS.len() as u64 * arguments.seeds;
    let bar = progress(runs, "commissioning axes whose truth is hidden");
    let judgements = validate(arguments.seeds, &bar)?;
    bar.finish_and_clear();
    println!("Simulated, not measured.\n");
    arguments.output.tables(
        "Identification judged by the truth",
        "Axes of the simulated stage, whose truth was hidden from identification; simulated, not measured",
        vec![validation_table(&judgements)],
        "validation",
    )
}
