//! `quadrant numerics`.

use clap::Args;
use quadrant_sim::experiment::compensator::Setup;
use quadrant_sim::experiment::numerics;
use quadrant_sim::presentation::numerics_table;

use super::output::{Output, progress};

/// Options of `quadrant numerics`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    output: Output,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let bar = progress(numerics::RUNS, "comparing number types");
    let numerics = numerics::run_all(&Setup::both()?, output.seed, &bar)?;
    bar.finish_and_clear();
    output.tables(
        "What the number type costs",
        "f32 and fixed point against f64 over the whole comparison; simulated, not measured",
        vec![numerics_table(&numerics)],
        "numerics",
    )
}
