//! The command `quadrant identify motor-constant`.

use std::path::PathBuf;

use clap::Args;
use quadrant_cli::output::{Output, with_bar};
use quadrant_pages::identify::linear::motor_constant_table;
use quadrant_pages::identify::motor_constant::motor_constant_section;
use quadrant_settings::AxisSettings;
use quadrant_tune::commission::bootstrap::{bootstrap_settings, zero_gain_settings};
use quadrant_tune::identify::motor_constant::{
    MotorConstant, MotorConstantSettings, evaluate, measure,
};
use quadrant_tune::test_axis::TestAxis;

use super::recorded;
use crate::subject::{Destination, Subject};

/// Options of `quadrant identify motor-constant`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
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
    destination: Destination,
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

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        subject,
        destination,
        output,
        ..
    } = arguments;
    output.ready()?;
    let settings = MotorConstantSettings {
        dwell_s: arguments.dwell_s,
        ..MotorConstantSettings::default()
    };
    let (motor, title, stage) = match &arguments.record {
        Some(path) => {
            let found = evaluate(recorded::read(path)?, &settings, arguments.resolution_mm)?;
            let paths = std::slice::from_ref(path);
            (found, recorded::title(paths), None)
        }
        None => {
            let start = subject.start_axis(destination.into.as_deref())?;
            let measured = subject.measure(
                output.seed,
                start.as_ref(),
                Some(TRAVEL_MM),
                |test_axis, base| {
                    let found = step_voltage(test_axis, base, &settings)?;
                    let path = output.file("motor-constant-recording.csv")?;
                    found.recording.write_csv(&path)?;
                    Ok(found)
                },
            )?;
            (measured.found, measured.title, Some(measured.stage))
        }
    };
    let mass = arguments.moving_mass_kg;
    output.table(&motor_constant_table(&motor, mass))?;
    output.section(
        "Motor constant",
        &title,
        motor_constant_section(&motor, mass),
        "motor-constant.html",
    )?;
    let records = arguments.record.as_slice();
    let rate_hz = stage
        .as_ref()
        .map_or(DEFAULT_RATE_HZ, |stage| stage.rate_hz);
    // What the constant is for: a controller that homes the axis and measures the rest.
    destination.write(subject, stage, records, &["first PID"], |settings| {
        // A model that was measured on this axis stays.
        let plant = settings.plant.filter(|_| settings.commissioned);
        *settings = AxisSettings {
            plant,
            ..bootstrap_settings(settings, motor.gain_mm_per_v_s2, rate_hz)
        };
    })
}

/// Travel of an axis of which none is known, mm.
pub(crate) const TRAVEL_MM: f64 = 20.0;
/// Control rate of a saved test's axis, Hz.
const DEFAULT_RATE_HZ: f64 = 1e4;

/// Steps the voltage of an axis in open loop, under a law that does nothing.
pub(crate) fn step_voltage(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    settings: &MotorConstantSettings,
) -> anyhow::Result<MotorConstant> {
    test_axis.apply(&zero_gain_settings(base))?;
    let found = with_bar("voltage steps in open loop", |progress| {
        measure(test_axis, settings, progress)
    })?;
    Ok(found)
}
