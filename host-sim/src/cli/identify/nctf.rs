//! `quadrant identify nctf`.

use std::path::PathBuf;

use clap::Args;
use quadrant::control::surface::SurfaceGains;
use quadrant_sim::identify::characteristic::{
    Characteristic, CharacteristicSettings, evaluate, measure,
};
use quadrant_sim::presentation::{characteristic_section, characteristic_table, provenance};
use quadrant_sim::settings_file::SettingsFile;

use super::rig::Axis;
use super::{page, recorded, simulated};
use crate::cli::output::{Output, command_line, share};

/// Options of `quadrant identify nctf`.
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
    /// Settings whose PID decides the slope at the origin; without them, the default's.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Largest velocity of the trajectory, mm/s; without it, the settings' limit.
    #[arg(long, value_name = "MM_S", value_parser = speed)]
    most_mm_s: Option<f64>,
    #[command(flatten)]
    output: Output,
}

fn speed(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    (value > 0.0 && value <= 1e3)
        .then_some(value)
        .ok_or_else(|| "it must be above zero, to 1000 mm/s".to_owned())
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let (found, title) = match (&arguments.record, arguments.axis) {
        (Some(path), _) => {
            let found = evaluate(recorded::read(path)?, arguments.resolution_mm)?;
            (found, recorded::title(std::slice::from_ref(path)))
        }
        (None, Some(axis)) => (measured(axis, arguments)?, simulated(axis)),
        (None, None) => return Ok(()),
    };
    let stage = match &arguments.settings {
        Some(path) => SettingsFile::read(path)?.stage,
        None => quadrant::settings::StageSettings::default(),
    };
    let settings = &stage.axes[arguments.axis.map_or(0, Axis::index)];
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
    let page = page(
        "Nominal characteristic trajectory",
        &title,
        vec![characteristic_section(&found, surface.slope_per_s, &points)],
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "nctf.html")
}

/// The test on an axis of the simulated stage, whose recording is saved.
fn measured(axis: Axis, arguments: &Arguments) -> anyhow::Result<Characteristic> {
    let output = &arguments.output;
    let settings = CharacteristicSettings {
        velocity_mm_s: arguments.velocity_mm_s,
        ..CharacteristicSettings::default()
    };
    let bar = share("coasting in open loop");
    let found = measure(&mut axis.test_axis(output.seed), &settings, &mut |done| {
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.finish_and_clear();
    println!("Simulated, not measured.");
    found
        .recording
        .write_csv(output.file("nctf-recording.csv")?)?;
    Ok(found)
}
