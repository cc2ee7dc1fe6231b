//! `quadrant identify virgin-curve`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use quadrant::settings::AxisSettings;
use quadrant_sim::commission::bootstrap::low_bandwidth_settings;
use quadrant_sim::identify::virgin_curve::{Knots, VirginCurveSettings, identify, measure};
use quadrant_sim::machine::TestAxis;
use quadrant_sim::presentation::{gms_table, presliding_section, provenance};
use quadrant_sim::record::Recording;
use quadrant_sim::settings_file::SettingsFile;

use super::rig::Axis;
use super::{page, recorded, simulated};
use crate::cli::output::{Output, command_line, share};

/// Options of `quadrant identify virgin-curve`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage; with --record, which axis of --settings it is.
    #[arg(long, value_enum, required_unless_present = "record")]
    axis: Option<Axis>,
    /// A recorded slow sine instead: a CSV file with t_s, position_mm (or position_m), voltage_v.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Settings with the static friction of the axis and the linear model that its quiet controller is made for. Without them the
    /// record's own plateau stands for the friction, and the simulated axis is measured under its default settings.
    #[arg(long, value_name = "FILE", requires = "axis")]
    settings: Option<PathBuf>,
    /// Amplitude of the sine, um: it must outrun the controller's error at breakaway; too small a one is refused with one that
    /// does. Without it twice that error.
    #[arg(long, value_name = "UM")]
    amplitude_um: Option<f64>,
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
    let settings = arguments.axis_settings()?;
    let (recording, title) = match (&arguments.record, arguments.axis) {
        (Some(path), _) => {
            let paths = std::slice::from_ref(path);
            (recorded::read(path)?, recorded::title(paths))
        }
        (None, Some(axis)) => {
            let (recording, sine) = measured(arguments, axis, settings.as_ref())?;
            println!(
                "Sine of {:.0} um at {} Hz",
                1e3 * sine.amplitude_mm,
                sine.frequency_hz
            );
            (recording, simulated(axis))
        }
        (None, None) => return Ok(()),
    };
    let known = settings.map(|settings| settings.friction.sliding);
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
    let page = page(
        "Pre-sliding friction",
        &title,
        vec![presliding_section(&found, breakaway_v)],
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "virgin-curve.html")
}

/// The slow sine on an axis of the simulated stage under a quiet controller, whose recording is saved.
fn measured(
    arguments: &Arguments,
    axis: Axis,
    settings: Option<&AxisSettings>,
) -> anyhow::Result<(Recording, VirginCurveSettings)> {
    let output = &arguments.output;
    let mut test_axis = axis.test_axis(output.seed);
    let base = settings.unwrap_or(test_axis.settings()).clone();
    let plant = base.plant.context(
        "the settings hold no linear model to make a quiet controller for; run `quadrant commission` first",
    )?;
    let quiet = low_bandwidth_settings(&base, &plant, test_axis.info().rate_hz);
    test_axis.apply(&quiet)?;
    let usual = VirginCurveSettings::outrunning(
        quiet.feedback.pid.kp_v_per_mm,
        base.friction.sliding.positive.curve.breakaway_v,
    );
    let sine = VirginCurveSettings {
        amplitude_mm: arguments
            .amplitude_um
            .map_or(usual.amplitude_mm, |um| 1e-3 * um),
        frequency_hz: arguments.frequency_hz,
        cycles: arguments.cycles,
    };
    let bar = share("moving slowly to and fro");
    let recording = measure(&mut test_axis, &sine, &mut |done| {
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.finish_and_clear();
    println!("Simulated, not measured.");
    recording.write_csv(output.file("virgin-curve-recording.csv")?)?;
    Ok((recording, sine))
}

impl Arguments {
    /// The settings of the axis, if a file is given.
    fn axis_settings(&self) -> anyhow::Result<Option<AxisSettings>> {
        let (Some(path), Some(axis)) = (&self.settings, self.axis) else {
            return Ok(None);
        };
        let stage = SettingsFile::read(path)?.stage;
        Ok(Some(stage.axes[axis.index()].clone()))
    }
}
