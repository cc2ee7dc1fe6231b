//! The command `quadrant identify static-friction`.

use std::path::PathBuf;

use clap::Args;
use quadrant_cli::output::{Output, with_bar};
use quadrant_law::friction::FrictionSettings;
use quadrant_pages::identify::friction::{friction_section, friction_table};
use quadrant_settings::AxisSettings;
use quadrant_tune::commission::bootstrap::measuring_settings;
use quadrant_tune::identify::single_state::with_all_models;
use quadrant_tune::identify::static_friction::{
    Exponent, FrictionMap, StaticFrictionSettings, fit_map, measure,
};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::TestAxis;

use super::recorded;
use crate::subject::{Destination, Subject};

/// Options of `quadrant identify static-friction`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// A recorded friction map instead, as this command saves it: velocity_mm_s, voltage_v, deviation_v, stick_slip.
    #[arg(long, visible_alias = "map", value_name = "FILE")]
    record: Option<PathBuf>,
    /// Velocity of the slowest run, mm/s.
    #[arg(long, default_value_t = 0.1, value_name = "MM_S")]
    from_mm_s: f64,
    /// Velocity of the fastest run, mm/s.
    #[arg(long, default_value_t = 40.0, value_name = "MM_S")]
    to_mm_s: f64,
    /// Velocities, even on a log scale, each run both ways.
    #[arg(long, default_value_t = 16)]
    velocities: usize,
    /// Length over which the voltage is averaged, mm: whole turns of the screw.
    #[arg(long, default_value_t = 10.0, value_name = "MM")]
    stretch_mm: f64,
    /// Exponent of the Stribeck curve; fitted if it is not given.
    #[arg(long, value_name = "DELTA")]
    exponent: Option<f64>,
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    output: Output,
}

/// File of the map in the folder for results.
const MAP: &str = "friction-map.csv";
/// Travel of an axis of which none is known, mm.
pub(crate) const TRAVEL_MM: f64 = 200.0;

/// Puts friction that was identified into settings; how the smoothed GMS rounds it is a person's choice.
pub(super) fn put_friction(settings: &mut AxisSettings, found: FrictionSettings) {
    settings.friction = FrictionSettings {
        smoothed_gms: settings.friction.smoothed_gms,
        ..found
    };
}

/// Moves an axis at constant velocities under the PID of `base` alone.
pub(crate) fn run_at_velocities(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    settings: &StaticFrictionSettings,
) -> anyhow::Result<(FrictionMap, Vec<Recording>)> {
    test_axis.apply(&measuring_settings(base))?;
    let found = with_bar("moving at constant velocity", |progress| {
        measure(test_axis, settings, progress)
    })?;
    Ok(found)
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        subject,
        destination,
        output,
        ..
    } = arguments;
    output.ready()?;
    let exponent = arguments.exponent.map_or(Exponent::Free, Exponent::Fixed);
    let (map, title, stage) = match &arguments.record {
        None => {
            let settings = StaticFrictionSettings {
                velocities_mm_s: (arguments.from_mm_s, arguments.to_mm_s),
                count: arguments.velocities,
                stretch_mm: arguments.stretch_mm,
                ..StaticFrictionSettings::default()
            };
            let start = subject.start_axis(destination.into.as_deref())?;
            let measured = subject.measure(
                output.seed,
                start.as_ref(),
                Some(TRAVEL_MM),
                |test_axis, base| {
                    let (map, recordings) = run_at_velocities(test_axis, base, &settings)?;
                    for (recording, number) in recordings.iter().zip(1..) {
                        let file = output.file(&format!("friction-recording-{number}.csv"))?;
                        recording.write_csv(&file)?;
                    }
                    map.write_csv(&output.file(MAP)?)?;
                    Ok(map)
                },
            )?;
            (measured.found, measured.title, Some(measured.stage))
        }
        Some(path) => {
            let map = FrictionMap::read_csv(path)?;
            map.write_csv(&output.file(MAP)?)?;
            (map, recorded::title(std::slice::from_ref(path)), None)
        }
    };
    let found = fit_map(&map, exponent, None)?;
    output.table(&friction_table(&found))?;
    output.section(
        "Static friction",
        &title,
        friction_section(&map, &found),
        "static-friction.html",
    )?;
    let records = arguments.record.as_slice();
    destination.write(subject, stage, records, &["friction"], |settings| {
        let gms = settings.friction.gms.clone();
        put_friction(settings, with_all_models(found.models(), gms));
    })
}
