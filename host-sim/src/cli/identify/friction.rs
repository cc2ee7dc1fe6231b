//! `quadrant identify static-friction`.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::identify::static_friction::{
    Exponent, FrictionMap, StaticFrictionSettings, fit_map, measure,
};
use quadrant_sim::presentation::{friction_section, friction_table, provenance};

use super::rig::Axis;
use super::{page, recorded, simulated};
use crate::cli::output::{Output, command_line, share};

/// Options of `quadrant identify static-friction`.
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
    /// A recorded friction map instead, as this command saves it: velocity_mm_s, voltage_v, deviation_v, stick_slip.
    #[arg(long, visible_alias = "map", value_name = "FILE")]
    record: Option<PathBuf>,
    /// Slowest velocity, mm/s.
    #[arg(long, default_value_t = 0.1, value_name = "MM_S")]
    from_mm_s: f64,
    /// Fastest velocity, mm/s.
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
    output: Output,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let exponent = arguments.exponent.map_or(Exponent::Free, Exponent::Fixed);
    let (map, title) = match (&arguments.record, arguments.axis) {
        (None, Some(axis)) => {
            let settings = StaticFrictionSettings {
                velocities_mm_s: (arguments.from_mm_s, arguments.to_mm_s),
                count: arguments.velocities,
                stretch_mm: arguments.stretch_mm,
                ..StaticFrictionSettings::default()
            };
            let bar = share("moving at constant velocity");
            let (map, recordings) =
                measure(&mut axis.test_axis(output.seed), &settings, &mut |done| {
                    bar.set_position((1000.0 * done) as u64);
                })?;
            bar.finish_and_clear();
            for (index, recording) in recordings.iter().enumerate() {
                recording
                    .write_csv(output.file(&format!("friction-recording-{}.csv", index + 1))?)?;
            }
            println!("Simulated, not measured.");
            (map, simulated(axis))
        }
        (Some(path), _) => (
            FrictionMap::read_csv(path)?,
            recorded::title(std::slice::from_ref(path)),
        ),
        (None, None) => return Ok(()),
    };
    map.write_csv(output.file("friction-map.csv")?)?;
    let found = fit_map(&map, exponent)?;
    output.table(&friction_table(&found))?;
    let page = page(
        "Static friction",
        &title,
        vec![friction_section(&map, &found)],
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "static-friction.html")
}
