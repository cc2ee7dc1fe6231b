//! Learning on friction that nobody modelled: the recorded friction of EMPS acts on a frictionless axis that follows the recorded
//! motion. The first half of the record is there to be fitted to and learnt from, the second is scored.
//!
//! Friction is what is left of the recorded voltage without inertia. It acts as the record has it, in every motion: right as
//! long as the axis stays within micrometres of the recorded motion.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use quadrant_law::reference::{MotionScale, RecordedTable};
use quadrant_pages::replay::recorded::{Axis, emps_axis, recorded_motion};
use quadrant_report::{Cell, Column, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::AxisParameters;
use quadrant_sim::plant::load::{Force, Load};
use quadrant_tune::identify::motion::{
    MotionFitSettings, MotionModel, Signals, fit_motion, recommended,
};
use quadrant_tune::record::Recording;
use rayon::prelude::*;

use super::run::{Friction, Nothing, Phase, run};
use super::starts::catalogue;

/// Pre-sliding range of a catalogue, mm.
const RANGE_MM: f64 = 0.03;

/// The recorded motion and friction.
struct Experiment {
    table: RecordedTable<f32>,
    load: Load,
    truth: AxisParameters,
    /// Half the record's duration, s.
    half_s: f64,
}

impl Experiment {
    fn new(recording: &Recording, axis: &Axis, rate_hz: f64) -> anyhow::Result<Self> {
        let signals = Signals::new(recording, &MotionFitSettings::default());
        let sample_time_s = signals.sample_time_s;
        let scale = MotionScale {
            resolution_mm: axis.settings.encoder.resolution_mm,
            rate_hz,
        };
        let table = recorded_motion(&signals.position_mm, sample_time_s, scale)?;
        let friction = signals.voltage_v.iter().zip(&signals.acceleration_mm_s2);
        let force = Force {
            sample_time_s,
            force_n: friction
                .map(|(voltage, acceleration)| acceleration / axis.truth.gain_mm_per_v_s2 - voltage)
                .collect(),
        };
        let mut truth = axis.truth.clone().with_friction(0.0);
        truth.imperfections.offset_v = 0.0;
        Ok(Self {
            table,
            load: Load::Recorded {
                force: Arc::new(force),
                newtons_per_volt: 1.0,
            },
            truth,
            half_s: 0.5 * signals.position_mm.len() as f64 * sample_time_s,
        })
    }

    /// RMS and largest error of the second half, um, and the scale at its end.
    fn score(
        &self,
        axis: &AxisSettings,
        friction: Friction,
        seed: u64,
    ) -> anyhow::Result<[f64; 3]> {
        let stage = StageSettings::simulated();
        let phase = Phase::recorded(self.table.clone(), self.truth.clone());
        let phases = [phase.loaded(self.load.clone())];
        let traces = run(&stage, &friction.of(axis), &phases, &mut Nothing, seed)?;
        let trace = &traces[0];
        Ok([
            trace.rms_um(self.half_s, stage.rate_hz),
            trace.largest_um(self.half_s, stage.rate_hz),
            trace.learnt(),
        ])
    }
}

/// The axis with friction, inertia and offset as a fit found them.
fn identified(axis: &AxisSettings, model: &MotionModel) -> AxisSettings {
    let mut axis = axis.clone();
    axis.friction = model.friction_settings();
    axis.feedforward.gains.inertia_v_s2_per_mm = model.inertia_v_s2_per_mm;
    axis.amplifier.offset_v = model.offset_v;
    axis
}

/// The table of what is left of the second half of the record.
///
/// # Errors
/// A record that cannot be read or fitted, or a run that fails.
pub(super) fn table(path: &Path, seed: u64) -> anyhow::Result<Table> {
    let recording = Recording::read_csv(path).with_context(|| path.display().to_string())?;
    let axis = emps_axis()?;
    let experiment = Experiment::new(&recording, &axis, StageSettings::simulated().rate_hz)?;
    let first_half = recording.slice(0..recording.len() / 2);
    let candidates = fit_motion(&first_half, &MotionFitSettings::default(), &|_| {})?;
    let model = &recommended(&candidates)
        .context("no model of the record is one of friction")?
        .model;
    let published = &axis.settings;
    let level_v = published.friction.sliding.positive.curve.coulomb_v;
    let of_catalogue = |level: f64| catalogue(published, level * level_v, RANGE_MM);
    let cases = [
        ("published model".to_owned(), published.clone()),
        (
            "level as published, catalogue's shape".to_owned(),
            of_catalogue(1.0),
        ),
        ("the same, level x 0.5".to_owned(), of_catalogue(0.5)),
        ("the same, level x 2".to_owned(), of_catalogue(2.0)),
        (
            format!("fitted to the first half: {}", model.structure.name()),
            identified(published, model),
        ),
    ];
    let rows = cases
        .into_par_iter()
        .map(|(name, axis)| {
            let mut row = vec![Cell::text(name)];
            for friction in Friction::ALL {
                let [rms_um, largest_um, scale] = experiment.score(&axis, friction, seed)?;
                row.extend([Cell::number(rms_um, 2), Cell::number(largest_um, 1)]);
                if friction == Friction::Learning {
                    row.push(Cell::number(scale, 3));
                }
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let um = |heading| Column::with_unit(heading, "um");
    Ok(Table {
        id: "recorded".to_owned(),
        caption: "Recorded friction of EMPS on a simulated axis under a PID: RMS and largest error of the second half of the record"
            .to_owned(),
        columns: vec![
            Column::new("friction set"),
            um("RMS, without"),
            um("largest, without"),
            um("RMS, fixed"),
            um("largest, fixed"),
            um("RMS, learning"),
            um("largest, learning"),
            Column::new("scale learnt"),
        ],
        rows,
    })
}
