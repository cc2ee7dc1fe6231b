//! The command `quadrant identify virgin-curve`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use quadrant_cli::output::{Output, with_bar};
use quadrant_cli::say;
use quadrant_pages::identify::friction::{gms_table, presliding_section};
use quadrant_settings::AxisSettings;
use quadrant_tune::commission::bootstrap::low_bandwidth_settings;
use quadrant_tune::identify::single_state::with_all_models;
use quadrant_tune::identify::virgin_curve::{Knots, VirginCurveSettings, identify, measure};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::TestAxis;

use super::friction::put_friction;
use super::recorded;
use crate::numbers::Numbers;
use crate::subject::{Destination, Subject};

/// Options of `quadrant identify virgin-curve`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// A recorded slow sine instead: a CSV file with t_s, position_mm (or position_m), voltage_v.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Amplitude of the sine, um: it must outrun the controller's error at breakaway; too small a one is refused with one that
    /// does. Without it twice that error.
    #[arg(long, value_name = "UM")]
    amplitude_um: Option<f64>,
    /// Frequency of the sine, Hz.
    #[arg(long, default_value_t = 0.1, value_name = "HZ")]
    frequency_hz: f64,
    /// Cycles of the sine that are run.
    #[arg(long, default_value_t = 3.0)]
    cycles: f64,
    /// Slip-blocks, their knots picked automatically.
    #[arg(long, default_value_t = 4)]
    blocks: usize,
    /// Knots, um, instead of automatic ones: 1,4,10,30.
    #[arg(long, value_name = "UM,...")]
    knots_um: Option<Numbers>,
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    output: Output,
}

/// Travel of an axis of which none is known, mm.
pub(crate) const TRAVEL_MM: f64 = 200.0;

/// Sine, as far as it is asked for; the rest follows from the axis' settings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sine {
    pub(crate) amplitude_mm: Option<f64>,
    pub(crate) frequency_hz: Option<f64>,
    pub(crate) cycles: Option<f64>,
}

impl Sine {
    /// Moves an axis in the sine under a controller of low bandwidth; returns the recording and the sine.
    pub(crate) fn measure(
        self,
        test_axis: &mut dyn TestAxis,
        base: &AxisSettings,
    ) -> anyhow::Result<(Recording, VirginCurveSettings)> {
        let plant = base.plant.context(
            "the settings hold no linear model to make a quiet controller for; run `commission` or `identify plant` first, \
             or load commissioned settings",
        )?;
        let quiet = low_bandwidth_settings(base, &plant, test_axis.info().rate_hz);
        test_axis.apply(&quiet)?;
        let usual = VirginCurveSettings::outrunning(
            quiet.feedback.pid.kp_v_per_mm,
            base.friction.sliding.positive.curve.breakaway_v,
        );
        let sine = VirginCurveSettings {
            amplitude_mm: self.amplitude_mm.unwrap_or(usual.amplitude_mm),
            frequency_hz: self.frequency_hz.unwrap_or(usual.frequency_hz),
            cycles: self.cycles.unwrap_or(usual.cycles),
        };
        let recording = with_bar("moving slowly to and fro", |progress| {
            measure(test_axis, &sine, progress)
        })?;
        Ok((recording, sine))
    }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        subject,
        destination,
        output,
        ..
    } = arguments;
    output.ready()?;
    let start = subject.start_axis(destination.into.as_deref())?;
    let (recording, title, stage) = match &arguments.record {
        Some(path) => {
            let paths = std::slice::from_ref(path);
            (recorded::read(path)?, recorded::title(paths), None)
        }
        None => {
            let sine = Sine {
                amplitude_mm: arguments.amplitude_um.map(|um| 1e-3 * um),
                frequency_hz: Some(arguments.frequency_hz),
                cycles: Some(arguments.cycles),
            };
            let measured = subject.measure(
                output.seed,
                start.as_ref(),
                Some(TRAVEL_MM),
                |test_axis, base| {
                    let (recording, sine) = sine.measure(test_axis, base)?;
                    recording.write_csv(&output.file("virgin-curve-recording.csv")?)?;
                    Ok((recording, sine))
                },
            )?;
            let (recording, sine) = measured.found;
            say!(
                "Sine of {:.0} um at {} Hz",
                1e3 * sine.amplitude_mm,
                sine.frequency_hz
            );
            (recording, measured.title, Some(measured.stage))
        }
    };
    let known = start.map(|settings| settings.friction.sliding);
    let knots = match &arguments.knots_um {
        None => Knots::Automatic(arguments.blocks),
        Some(Numbers(knots_um)) => Knots::At(knots_um.iter().map(|um| 1e-3 * um).collect()),
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
    output.section(
        "Pre-sliding friction",
        &title,
        presliding_section(&found, breakaway_v),
        "virgin-curve.html",
    )?;
    let records = arguments.record.as_slice();
    destination.write(subject, stage, records, &["friction"], |settings| {
        let sliding = settings.friction.sliding;
        put_friction(settings, with_all_models(sliding, found.gms.clone()));
    })
}
