//! `quadrant-studies numerics`.

use clap::Args;
use quadrant_cli::output::{Output, progress};
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_sim::identified_stage::identified_settings;

use crate::numerics;
use crate::numerics::page::numerics_table;

/// Options of `quadrant-studies numerics`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    output: Output,
}

/// Runs the study, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let bar = progress(numerics::RUNS, "comparing number types");
    let numerics = numerics::run_all(
        &RunConfiguration::both(&identified_settings()?.stage),
        output.seed,
        &bar,
    )?;
    bar.finish_and_clear();
    output.tables(
        "What the number type costs",
        "f32 and fixed point against f64 over the whole comparison; simulated, not measured",
        vec![numerics_table(&numerics)],
        "numerics",
    )
}
