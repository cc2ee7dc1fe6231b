//! `quadrant-studies outputs`.

use clap::Args;
use quadrant_cli::output::Output;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_sim::identified_stage::identified_settings;

use crate::outputs;
use crate::outputs::page::outputs_table;

/// Options of `quadrant-studies outputs`.
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
    let setup = RunConfiguration::identified(identified_settings()?.stage);
    let runs = outputs::run_all(&setup, output.seed)?;
    output.tables(
        "What a coarser output costs",
        "16 bits against 12 bits, plain and shaped; simulated, not measured",
        vec![outputs_table(&runs)],
        "outputs",
    )
}
