//! Learning after a change: another tool or work-piece, and a rest in which friction has drifted.

use std::sync::Arc;

use quadrant_report::{Cell, Column, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::AxisParameters;
use quadrant_sim::plant::load::{Force, Load};
use rayon::prelude::*;

use super::run::{Friction, Nothing, Phase, SINE, cycle_s, run};
use super::starts::nominal;

/// Length of the rest, s: an hour.
const REST_S: f64 = 3600.0;

/// Cycles of the sine before a change.
const BEFORE: f64 = 2.25;
/// Cycles of the sine after it.
const AFTER: f64 = 3.25;

/// Before and after: friction and mass over the nominal ones; the rest between.
struct Change {
    name: &'static str,
    before: AxisParameters,
    rest_s: f64,
    after: AxisParameters,
    /// Force that begins with the rest and stays, V.
    load_v: f64,
}

fn changes() -> Vec<Change> {
    let change = |name, before, rest_s, after| Change {
        name,
        before,
        rest_s,
        after,
        load_v: 0.0,
    };
    let loaded = |name, load_v| Change {
        load_v,
        ..change(name, nominal(), 1.0, nominal())
    };
    let cold = || nominal().with_friction(1.5);
    vec![
        change("rest of 0.1 s", nominal(), 0.1, nominal()),
        change("rest of 1 s", nominal(), 1.0, nominal()),
        change("rest of 10 s", nominal(), 10.0, nominal()),
        loaded("load of +0.05 V", 0.05),
        loaded("load of -0.05 V", -0.05),
        loaded("load of +0.2 V", 0.2),
        loaded("load of -0.2 V", -0.2),
        change("mass x 1.3", nominal(), 1.0, nominal().with_mass(1.3)),
        change("mass x 0.7", nominal(), 1.0, nominal().with_mass(0.7)),
        change(
            "friction x 1.5, then mass x 1.3",
            cold(),
            1.0,
            cold().with_mass(1.3),
        ),
        change(
            "friction x 1.5, an hour of rest, x 1.5",
            cold(),
            REST_S,
            cold(),
        ),
        change(
            "friction x 1.5, an hour of rest, x 1",
            cold(),
            REST_S,
            nominal(),
        ),
        change(
            "friction x 1, an hour of rest, x 1.5",
            nominal(),
            REST_S,
            cold(),
        ),
    ]
}

/// A force that stays the same, V.
fn constant(load_v: f64) -> Load {
    let force = Force {
        sample_time_s: 1.0,
        force_n: vec![load_v],
    };
    Load::Recorded {
        force: Arc::new(force),
        newtons_per_volt: 1.0,
    }
}

/// The table of changes: largest errors of the first and of the last cycle after the change.
pub(super) fn table(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<Table> {
    let rows = changes()
        .into_par_iter()
        .map(|change| {
            let load = constant(change.load_v);
            let phases = [
                Phase::sine(SINE, BEFORE, change.before.clone()),
                Phase::rest(change.rest_s, change.before.clone()).loaded(load.clone()),
                Phase::sine(SINE, AFTER, change.after.clone()).loaded(load),
            ];
            let mut row = vec![Cell::text(change.name)];
            for friction in Friction::ALL {
                let axis = friction.of(axis);
                let traces = run(stage, &axis, &phases, &mut Nothing, seed)?;
                let after = &traces[2];
                let cycle = (cycle_s(SINE) * stage.rate_hz) as usize;
                let first = after.error_um[..cycle.min(after.error_um.len())].iter();
                let first = first.fold(0.0, |most: f64, error| most.max(error.abs()));
                let last = after.largest_um(cycle_s(SINE), stage.rate_hz);
                row.extend([Cell::number(first, 1), Cell::number(last, 1)]);
                if friction == Friction::Learning {
                    let held = traces[1].learnt();
                    row.extend([Cell::number(held, 3), Cell::number(after.learnt(), 3)]);
                }
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let um = |heading| Column::with_unit(heading, "um");
    Ok(Table {
        id: "changes".to_owned(),
        caption: "Simulated. Largest errors of a sine (30 mm, 10 mm/s) under PID, first and last cycle after a change"
            .to_owned(),
        columns: vec![
            Column::new("change"),
            um("first, without"),
            um("last, without"),
            um("first, fixed"),
            um("last, fixed"),
            um("first, learning"),
            um("last, learning"),
            Column::new("scale before"),
            Column::new("scale after"),
        ],
        rows,
    })
}
