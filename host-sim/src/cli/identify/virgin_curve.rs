//! `quadrant identify virgin-curve`.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::identify::virgin_curve::{Knots, VirginCurveSettings, identify, measure};
use quadrant_sim::presentation::{gms_table, presliding_section, provenance};
use quadrant_sim::rig::Recording;
use quadrant_sim::settings_file::SettingsFile;

use super::rig::Axis;
use super::{page, recorded, simulated};
use crate::cli::output::{Output, share};

/// Options of `quadrant identify virgin-curve`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage; with --record, which axis of --settings it is.
    #[arg(long, value_enum, required_unless_present = "record")]
    axis: Option<Axis>,
    /// A recorded slow sine instead: a CSV file with t_s, position_mm (or position_m), voltage_v.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Settings with the static friction of the axis; without them the record's own plateau stands for it.
    #[arg(long, value_name = "FILE", requires = "axis")]
    settings: Option<PathBuf>,
    /// Amplitude of the sine, um: it must outrun the controller's error at breakaway; too small a one is refused with one that
    /// does.
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
    let known = match (&arguments.settings, arguments.axis) {
        (Some(path), Some(axis)) => {
            let stage = SettingsFile::read(path)?.stage;
            Some(stage.axes[axis.index()].friction.sliding)
        }
        _ => None,
    };
    let (recording, title, source) = match (&arguments.record, arguments.axis) {
        (Some(path), _) => {
            let paths = std::slice::from_ref(path);
            let (title, option) = (recorded::title(paths), recorded::option(paths));
            (recorded::read(path)?, title, option)
        }
        (None, Some(axis)) => {
            let source = format!(
                " --axis {} --amplitude-um {} --frequency-hz {} --cycles {}",
                axis.name(),
                arguments.amplitude_um,
                arguments.frequency_hz,
                arguments.cycles
            );
            (measured(arguments, axis)?, simulated(axis), source)
        }
        (None, None) => return Ok(()),
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
    let command = format!(
        "quadrant identify virgin-curve{source}{} --seed {}",
        arguments.options(),
        output.seed
    );
    let page = page(
        "Pre-sliding friction",
        &title,
        vec![presliding_section(&found, breakaway_v)],
        provenance(&command, output.seed),
    );
    output.page(&page, "virgin-curve.html")
}

/// The slow sine on an axis of the simulated stage, whose recording is saved.
fn measured(arguments: &Arguments, axis: Axis) -> anyhow::Result<Recording> {
    let output = &arguments.output;
    let settings = VirginCurveSettings {
        amplitude_mm: 1e-3 * arguments.amplitude_um,
        frequency_hz: arguments.frequency_hz,
        cycles: arguments.cycles,
    };
    let bar = share("moving slowly to and fro");
    let recording = measure(&mut axis.rig(output.seed), &settings, &mut |done| {
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.finish_and_clear();
    println!("Simulated, not measured.");
    recording.write_csv(output.file("virgin-curve-recording.csv")?)?;
    Ok(recording)
}

impl Arguments {
    /// The options that repeat the identification.
    fn options(&self) -> String {
        let mut options = if self.knots_um.is_empty() {
            format!(" --blocks {}", self.blocks)
        } else {
            let knots: Vec<String> = self.knots_um.iter().map(f64::to_string).collect();
            format!(" --knots-um {}", knots.join(","))
        };
        if let (Some(path), Some(axis)) = (&self.settings, self.axis) {
            options += &format!(" --settings {}", path.display());
            if self.record.is_some() {
                options += &format!(" --axis {}", axis.name());
            }
        }
        options
    }
}
