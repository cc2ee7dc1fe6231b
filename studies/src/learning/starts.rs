//! Learning that begins with the wrong friction: gains of the settings, a history, and values of a catalogue.

use quadrant_law::friction::gms::{GmsElement, GmsElements, GmsParameters};
use quadrant_report::{Cell, Column, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use rayon::prelude::*;

use super::run::{Phase, SINE, cycle_s, nominal, run, under_pid};
use crate::competitor::Feedforward;

/// Cycles of the sine: three and a half make a minute, the last of them is scored.
const MINUTE_CYCLES: f64 = 3.25;

/// A start: its name, the settings, and what comes before the minute.
struct Start {
    name: String,
    axis: AxisSettings,
    before: Vec<Phase>,
}

impl Start {
    fn new(name: impl Into<String>, axis: AxisSettings) -> Self {
        Self {
            name: name.into(),
            axis,
            before: Vec::new(),
        }
    }

    /// The scale after the minute, and the largest and the RMS error of its last cycle, um.
    fn run(
        &self,
        stage: &StageSettings,
        feedforward: Feedforward,
        seed: u64,
    ) -> anyhow::Result<(f64, f64, f64)> {
        let mut phases = self.before.clone();
        phases.push(Phase::sine(SINE, MINUTE_CYCLES, nominal()));
        let axis = under_pid(&self.axis, feedforward);
        let traces = run(stage, &axis, &phases, seed)?;
        let last = &traces[phases.len() - 1];
        let scored_s = cycle_s(SINE);
        Ok((
            last.learnt(),
            last.largest_um(scored_s, stage.rate_hz),
            last.rms_um(scored_s, stage.rate_hz),
        ))
    }
}

/// The gains of the whole friction feedforward, times a factor.
fn with_gains(axis: &AxisSettings, factor: f64) -> AxisSettings {
    let mut axis = axis.clone();
    let gains = &mut axis.feedforward.gains;
    for gain in [&mut gains.presliding, &mut gains.level, &mut gains.viscous] {
        *gain *= factor;
    }
    axis
}

/// Starts with other gains, and with what another friction has taught before.
fn wrong_starts(axis: &AxisSettings) -> Vec<Start> {
    let taught = |name: &str, friction| Start {
        name: name.to_owned(),
        axis: axis.clone(),
        before: vec![Phase::sine(
            (5.0, 5.0),
            8.0,
            nominal().with_friction(friction),
        )],
    };
    vec![
        Start::new("as identified", axis.clone()),
        Start::new("gains x 0.4", with_gains(axis, 0.4)),
        Start::new("gains x 0.7", with_gains(axis, 0.7)),
        Start::new("gains x 2", with_gains(axis, 2.0)),
        taught("scale 0: friction x 0.02 before", 0.02),
        taught("scale 2: friction x 2 before", 2.0),
    ]
}

/// Elements of a spring that softens evenly up to the pre-sliding range: equal weights, evenly spaced limits.
fn even_elements(level_v: f64, range_mm: f64) -> GmsElements {
    const COUNT: usize = 8;
    let weight = 1.0 / COUNT as f64;
    (1..=COUNT)
        .map(|index| GmsElement {
            stiffness_v_per_mm: weight * level_v * COUNT as f64 / (range_mm * index as f64),
            weight,
        })
        .collect()
}

/// The settings of an axis with friction from a catalogue: one level for both senses, no Stribeck effect, no viscous friction,
/// and a pre-sliding range that nobody has measured.
fn catalogue(axis: &AxisSettings, level_v: f64, range_mm: f64) -> AxisSettings {
    let mut axis = axis.clone();
    let sliding = &mut axis.friction.sliding;
    for model in [&mut sliding.positive, &mut sliding.negative] {
        model.curve.coulomb_v = level_v;
        model.curve.breakaway_v = level_v;
        model.viscous_v_s_per_mm = 0.0;
    }
    axis.friction.gms = GmsParameters {
        elements: even_elements(level_v, range_mm),
        attraction_v_s: axis.friction.gms.attraction_v_s,
    };
    axis
}

/// The level of the data sheet over the true Coulomb level, and the range that is assumed, mm; the true one is 30 um.
const CATALOGUE: [(f64, f64); 9] = [
    (0.7, 0.015),
    (0.7, 0.030),
    (0.7, 0.060),
    (1.0, 0.015),
    (1.0, 0.030),
    (1.0, 0.060),
    (1.5, 0.015),
    (1.5, 0.030),
    (1.5, 0.060),
];

fn catalogue_starts(axis: &AxisSettings) -> Vec<Start> {
    let coulomb_v = nominal().friction.positive.curve.coulomb_v;
    let mut all = vec![Start::new("identified", axis.clone())];
    all.extend(CATALOGUE.map(|(level, range_mm)| {
        let name = format!("level x {level}, range {:.0} um", 1e3 * range_mm);
        Start::new(name, catalogue(axis, level * coulomb_v, range_mm))
    }));
    all
}

fn table(
    id: &str,
    caption: &str,
    starts: Vec<Start>,
    stage: &StageSettings,
    seed: u64,
) -> anyhow::Result<Table> {
    let rows = starts
        .into_par_iter()
        .map(|start| {
            let mut row = vec![Cell::text(&start.name)];
            for feedforward in Feedforward::ALL {
                let (learnt, largest, rms) = start.run(stage, feedforward, seed)?;
                row.extend([Cell::number(largest, 1), Cell::number(rms, 1)]);
                if feedforward == Feedforward::Learning {
                    row.push(Cell::number(learnt, 3));
                }
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let um = |heading| Column::with_unit(heading, "um");
    Ok(Table {
        id: id.to_owned(),
        caption: caption.to_owned(),
        columns: vec![
            Column::new("start"),
            um("largest, without"),
            um("RMS, without"),
            um("largest, fixed"),
            um("RMS, fixed"),
            um("largest, learning"),
            um("RMS, learning"),
            Column::new("scale learnt"),
        ],
        rows,
    })
}

/// The table of wrong starts, and that of catalogue values.
pub(super) fn tables(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<[Table; 2]> {
    Ok([
        table(
            "starts",
            "Simulated. Errors of the last cycle after a minute of a sine (30 mm, 10 mm/s), PID, from another start",
            wrong_starts(axis),
            stage,
            seed,
        )?,
        table(
            "catalogue",
            "Simulated. The same with friction from a catalogue: one level, no Stribeck effect, nothing viscous, a pre-sliding range that \
             is assumed (truly 30 um)",
            catalogue_starts(axis),
            stage,
            seed,
        )?,
    ])
}
