//! `quadrant outputs`.

use clap::Args;
use quadrant_sim::experiment::compensator::{Setup, identified};
use quadrant_sim::experiment::outputs;
use quadrant_sim::presentation::outputs_table;

use super::output::Output;

/// Options of `quadrant outputs`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    output: Output,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let setup = Setup::virtual_machine(identified()?.stage);
    let runs = outputs::run_all(&setup, output.seed)?;
    output.tables(
        "What a coarser output costs",
        "16 bits against 12 bits, plain and shaped; simulated, not measured",
        vec![outputs_table(&runs)],
        "outputs",
    )
}
