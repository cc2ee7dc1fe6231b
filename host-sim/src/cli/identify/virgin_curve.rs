//! `quadrant identify virgin-curve`.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::identify::virgin_curve::{Knots, VirginCurveSettings, identify, measure};
use quadrant_sim::presentation::{gms_table, presliding_section, provenance};
use quadrant_sim::rig::Recording;
use quadrant_sim::settings_file::SettingsFile;

use super::rig::Axis;
use super::{page, simulated};
use crate::cli::output::{Output, share};

/// Options of `quadrant identify virgin-curve`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage; with --record, the axis of --settings.
    #[arg(long, value_enum)]
    axis: Axis,
    /// A recorded slow sine: t_s, position_mm, voltage_v.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Settings with the static friction of the axis; without them the record's own plateau stands for it.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Amplitude of the sine, um.
    #[arg(long, default_value_t = 10.0, value_name = "UM")]
    amplitude_um: f64,
    /// Its frequency, Hz.
    #[arg(long, default_value_t = 0.1, value_name = "HZ")]
    frequency_hz: f64,
    /// Its cycles.
    #[arg(long, default_value_t = 3.0)]
    cycles: f64,
    /// Slip-blocks, their knots picked automatically.
    #[arg(long, default_value_t = 4)]
    blocks: usize,
    /// Knots, um, instead of automatic ones: 1,4,10,30.
    #[arg(long, value_delimiter = ',', value_name = "UM,...")]
    knots_um: Vec<f64>,
    #[command(flatten)]
    output: Output,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let axis = arguments.axis;
    let known = arguments
        .settings
        .as_ref()
        .map(SettingsFile::read)
        .transpose()?
        .map(|file| file.stage.axes[axis.index()].friction.sliding);
    let recording = match &arguments.record {
        Some(path) => Recording::read_csv(path)?,
        None => {
            let bar = share("moving slowly to and fro");
            let settings = VirginCurveSettings {
                amplitude_mm: 1e-3 * arguments.amplitude_um,
                frequency_hz: arguments.frequency_hz,
                cycles: arguments.cycles,
            };
            let recording = measure(&mut axis.rig(output.seed), &settings, &mut |done| {
                bar.set_position((1000.0 * done) as u64);
            })?;
            bar.finish_and_clear();
            println!("Simulated, not measured.");
            recording.write_csv(output.file("virgin-curve-recording.csv")?)?;
            recording
        }
    };
    let knots = if arguments.knots_um.is_empty() {
        Knots::Automatic(arguments.blocks)
    } else {
        Knots::At(arguments.knots_um.iter().map(|um| 1e-3 * um).collect())
    };
    let found = identify(&recording, known.as_ref(), &knots)?;
    output.table(&gms_table(&found))?;
    let breakaway_v = found
        .gms
        .elements
        .iter()
        .zip(&found.knots_mm)
        .map(|(element, knot)| element.stiffness_v_per_mm * knot)
        .sum();
    let source = arguments
        .record
        .as_ref()
        .map_or_else(String::new, |path| format!(" --record {}", path.display()));
    let command = format!(
        "quadrant identify virgin-curve --axis {}{source} --amplitude-um {} --seed {}",
        axis.name(),
        arguments.amplitude_um,
        output.seed
    );
    let page = page(
        "Pre-sliding friction",
        &simulated(axis),
        vec![presliding_section(&found, breakaway_v)],
        provenance(&command, output.seed),
    );
    output.page(&page, "virgin-curve.html")
}
