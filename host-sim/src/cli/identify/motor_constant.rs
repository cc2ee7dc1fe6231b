//! `quadrant identify motor-constant`.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::identify::motor_constant::{
    MotorConstant, MotorConstantSettings, evaluate, measure,
};
use quadrant_sim::presentation::{motor_constant_section, motor_constant_table, provenance};

use super::rig::Axis;
use super::{page, recorded, simulated};
use crate::cli::output::{Output, command_line, share};

/// Options of `quadrant identify motor-constant`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(
        long,
        value_enum,
        required_unless_present = "record",
        conflicts_with = "record"
    )]
    axis: Option<Axis>,
    /// A saved test instead, of voltage steps between two levels of one sign, passes both ways: a CSV file with t_s,
    /// position_mm (or position_m), voltage_v.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Time at each level of the voltage, s.
    #[arg(long, default_value_t = MotorConstantSettings::default().dwell_s, value_name = "S",
        value_parser = dwell)]
    dwell_s: f64,
    /// Length of an encoder count in a saved test, mm; the axis must slide by hundreds of counts at each level.
    #[arg(long, default_value_t = 5e-4, value_name = "MM", value_parser = above_zero)]
    resolution_mm: f64,
    /// Moving mass, kg: with it the force per volt is given too.
    #[arg(long, value_name = "KG", value_parser = above_zero)]
    moving_mass_kg: Option<f64>,
    #[command(flatten)]
    output: Output,
}

fn above_zero(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let holds = value.is_finite() && value > 0.0;
    holds
        .then_some(value)
        .ok_or_else(|| "it must be above zero".to_owned())
}

fn dwell(text: &str) -> Result<f64, String> {
    let value = above_zero(text)?;
    (1e-3..=1.0)
        .contains(&value)
        .then_some(value)
        .ok_or_else(|| "it must be 0.001 to 1 s, several times the axis' dead time".to_owned())
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let settings = MotorConstantSettings {
        dwell_s: arguments.dwell_s,
        ..MotorConstantSettings::default()
    };
    let (motor, title) = match (&arguments.record, arguments.axis) {
        (Some(path), _) => {
            let found = evaluate(recorded::read(path)?, &settings, arguments.resolution_mm)?;
            let paths = std::slice::from_ref(path);
            (found, recorded::title(paths))
        }
        (None, Some(axis)) => (measured(axis, &settings, output)?, simulated(axis)),
        (None, None) => return Ok(()),
    };
    let mass = arguments.moving_mass_kg;
    output.table(&motor_constant_table(&motor, mass))?;
    let page = page(
        "Motor constant",
        &title,
        vec![motor_constant_section(&motor, mass)],
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "motor-constant.html")
}

/// The test on an axis of the simulated stage, whose recording is saved.
fn measured(
    axis: Axis,
    settings: &MotorConstantSettings,
    output: &Output,
) -> anyhow::Result<MotorConstant> {
    let bar = share("voltage steps in open loop");
    let motor = measure(&mut axis.test_axis(output.seed), settings, &mut |done| {
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.finish_and_clear();
    println!("Simulated, not measured.");
    let path = output.file("motor-constant-recording.csv")?;
    motor.recording.write_csv(path)?;
    Ok(motor)
}
