//! The error that is left where the feedforward knows the friction: as identified and scaled by hand, and the simulated axis' own.

use quadrant_report::{Cell, Column, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use rayon::prelude::*;

use super::run::{Friction, Nothing, Phase, SINE, cycle_s, run};
use super::starts::{MINUTE_CYCLES, nominal, with_gains};

/// Friction over what it was when the axis was commissioned.
const FACTORS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];

/// The settings of an axis with the simulated axis' own friction model, `factor` times what it was.
fn with_true_friction(axis: &AxisSettings, factor: f64) -> AxisSettings {
    let truth = nominal().with_friction(factor);
    let mut axis = axis.clone();
    axis.friction.sliding = truth.friction;
    axis.friction.gms = truth.gms;
    axis
}

/// The table of friction that is known.
pub(super) fn table(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<Table> {
    let rows = FACTORS
        .into_par_iter()
        .map(|factor| {
            let competitors = [
                Friction::Without.of(axis),
                Friction::Fixed.of(&with_gains(axis, factor)),
                Friction::Fixed.of(&with_true_friction(axis, factor)),
                Friction::Learning.of(axis),
            ];
            let mut row = vec![Cell::text(format!("x {factor}"))];
            for settings in competitors {
                let truth = nominal().with_friction(factor);
                let phases = [Phase::sine(SINE, MINUTE_CYCLES, truth)];
                let traces = run(stage, &settings, &phases, &mut Nothing, seed)?;
                let scored_s = cycle_s(SINE);
                row.extend([
                    Cell::number(traces[0].largest_um(scored_s, stage.rate_hz), 1),
                    Cell::number(traces[0].rms_um(scored_s, stage.rate_hz), 1),
                ]);
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let um = |heading| Column::with_unit(heading, "um");
    Ok(Table {
        id: "known".to_owned(),
        caption: "Simulated. Errors of the last cycle after a minute of a sine (30 mm, 10 mm/s), PID, with other friction that the \
                  feedforward knows: identified and scaled by hand, the simulated axis' own, or learnt"
            .to_owned(),
        columns: vec![
            Column::new("friction"),
            um("largest, without"),
            um("RMS, without"),
            um("largest, scaled"),
            um("RMS, scaled"),
            um("largest, its own"),
            um("RMS, its own"),
            um("largest, learning"),
            um("RMS, learning"),
        ],
        rows,
    })
}
