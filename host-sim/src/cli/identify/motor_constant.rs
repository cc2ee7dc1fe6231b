//! `quadrant identify motor-constant`.

use clap::Args;
use quadrant_sim::identify::motor_constant::{MotorConstantSettings, measure};
use quadrant_sim::presentation::motor_constant_table;

use super::rig::Axis;
use crate::cli::output::{Output, share};

/// Options of `quadrant identify motor-constant`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum)]
    axis: Axis,
    /// Moving mass, kg: with it the force per volt is given too.
    #[arg(long, value_name = "KG")]
    moving_mass_kg: Option<f64>,
    #[command(flatten)]
    output: Output,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let bar = share("voltage steps in open loop");
    let motor = measure(
        &mut arguments.axis.rig(output.seed),
        &MotorConstantSettings::default(),
        &mut |done| bar.set_position((1000.0 * done) as u64),
    )?;
    bar.finish_and_clear();
    motor
        .recording
        .write_csv(output.file("motor-constant-recording.csv")?)?;
    output.table(&motor_constant_table(&motor, arguments.moving_mass_kg))
}
