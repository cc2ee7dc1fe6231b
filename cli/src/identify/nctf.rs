//! The command `quadrant identify nctf`.

use std::path::PathBuf;

use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::{Output, with_bar};
use quadrant_law::control::nctf::NctfGains;
use quadrant_law::control::surface::SurfaceGains;
use quadrant_pages::identify::characteristic::{characteristic_section, characteristic_table};
use quadrant_settings::AxisSettings;
use quadrant_tune::commission::bootstrap::zero_gain_settings;
use quadrant_tune::identify::characteristic::{
    Characteristic, CharacteristicSettings, evaluate, measure,
};
use quadrant_tune::test_axis::TestAxis;

use super::recorded;
use crate::subject::{Destination, Subject};

/// Options of `quadrant identify nctf`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// A saved test instead, in which the axis is driven and then left alone, both ways: a CSV file with t_s, position_mm
    /// (or position_m), voltage_v.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Speed to coast from, mm/s.
    #[arg(long, default_value_t = CharacteristicSettings::default().velocity_mm_s, value_name = "MM_S",
        value_parser = speed)]
    velocity_mm_s: f64,
    /// Length of an encoder count in a saved test, mm.
    #[arg(long, default_value_t = 5e-4, value_name = "MM")]
    resolution_mm: f64,
    /// Largest velocity of the trajectory, mm/s; without it, the settings' limit.
    #[arg(long, value_name = "MM_S", value_parser = speed)]
    most_mm_s: Option<f64>,
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    output: Output,
}

fn speed(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    (value > 0.0 && value <= 1e3)
        .then_some(value)
        .ok_or_else(|| "it must be above zero, to 1000 mm/s".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        subject,
        destination,
        output,
        ..
    } = arguments;
    output.ready()?;
    let start = subject
        .start(destination.into.as_deref())?
        .map(|file| file.stage);
    let index = subject.axis.map_or(0, Axis::index);
    let (found, title, machine) = match &arguments.record {
        Some(path) => {
            let found = evaluate(recorded::read(path)?, arguments.resolution_mm)?;
            (found, recorded::title(std::slice::from_ref(path)), None)
        }
        None => {
            let settings = CharacteristicSettings {
                velocity_mm_s: arguments.velocity_mm_s,
                ..CharacteristicSettings::default()
            };
            let start = start.as_ref().map(|stage| &stage.axes[index]);
            let measured = subject.measure(output.seed, start, None, |test_axis, base| {
                let found = coast(test_axis, base, &settings)?;
                let path = output.file("nctf-recording.csv")?;
                found.recording.write_csv(&path)?;
                Ok(found)
            })?;
            (measured.found, measured.title, Some(measured.stage))
        }
    };
    let stage = start.or_else(|| machine.clone()).unwrap_or_default();
    let settings = &stage.axes[index];
    let Some(surface) = SurfaceGains::from_pid(&settings.feedback.pid) else {
        anyhow::bail!(
            "feedback.pid has complex zeros, so no trajectory's slope belongs to it: lower its integral gain"
        );
    };
    let most_mm_s = arguments
        .most_mm_s
        .unwrap_or(settings.limits.max_velocity_mm_s);
    let points = found.points(surface.slope_per_s, most_mm_s);
    output.table(&characteristic_table(&points))?;
    output.section(
        "Nominal characteristic trajectory",
        &title,
        characteristic_section(&found, surface.slope_per_s, &points),
        "nctf.html",
    )?;
    let records = arguments.record.as_slice();
    destination.write(subject, machine, records, &["feedback.nctf"], |settings| {
        settings.feedback.nctf = Some(NctfGains {
            characteristic: points,
            gain_v_s_per_mm: surface.gain_v_s_per_mm,
            integral_per_s: surface.integral_per_s,
        });
    })
}

/// Drives an axis in open loop and leaves it alone, under a law that does nothing.
fn coast(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    settings: &CharacteristicSettings,
) -> anyhow::Result<Characteristic> {
    test_axis.apply(&zero_gain_settings(base))?;
    let found = with_bar("coasting in open loop", |progress| {
        measure(test_axis, settings, progress)
    })?;
    Ok(found)
}
