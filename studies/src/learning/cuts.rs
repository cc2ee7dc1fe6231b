//! The cut, with what else may be done about it.

use quadrant::control::plant_model::PlantModel;
use quadrant::reference::MotionSettings;
use quadrant::settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT};
use quadrant_sim::report::{Cell, Column, Table};
use rayon::prelude::*;

use super::remedies::{Cancelling, FedFriction, Observer};
use super::run::{Addition, Friction, Nothing, Phase, SINE, cycle_s, run};
use super::starts::nominal;

/// Passing frequencies of the teeth, Hz; the slot's is 100.
const PASSING_HZ: [f64; 9] = [20.0, 35.0, 50.0, 70.0, 100.0, 200.0, 300.0, 500.0, 800.0];

/// Cycles of the sine, the last of which is scored.
const CYCLES: f64 = 3.25;

/// Sinusoidal loads at rest: frequency, Hz, and amplitude, V, those of the compliance.
const LOADS_HZ: [f64; 2] = [5.0, 10.0];
const LOAD_V: f64 = 0.3;

/// Time of a load at rest, s, and its last part, which is scored.
const LOADED_S: f64 = 6.0;
const SCORED_S: f64 = 2.0;

/// Rate with which harmonics of the spindle are cancelled, 1/s.
const CANCELLING_PER_S: f64 = 3.0;

/// The voltage added to the law's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Remedy {
    None,
    Observer,
    Fed,
    Spindle,
}

/// The competitors: feedforward, and what is beside it.
const COMPETITORS: [(Friction, Remedy, &str); 9] = [
    (Friction::Without, Remedy::None, "without"),
    (Friction::Fixed, Remedy::None, "fixed"),
    (Friction::Learning, Remedy::None, "learning"),
    (Friction::Without, Remedy::Observer, "observer alone"),
    (Friction::Fixed, Remedy::Observer, "fixed, observer"),
    (Friction::Learning, Remedy::Observer, "learning, observer"),
    (Friction::Fixed, Remedy::Fed, "fixed, fed"),
    (Friction::Fixed, Remedy::Spindle, "fixed, spindle"),
    (Friction::Learning, Remedy::Spindle, "learning, spindle"),
];

/// A case: what happens to the axis.
struct Case {
    name: String,
    phase: Phase,
    scored_s: f64,
    /// Frequency of the spindle, Hz; it cuts with two teeth.
    spindle_hz: Option<f64>,
}

impl Case {
    fn sine(name: impl Into<String>, truth: AxisParameters) -> Self {
        Self {
            name: name.into(),
            phase: Phase::sine(SINE, CYCLES, truth),
            scored_s: cycle_s(SINE),
            spindle_hz: None,
        }
    }

    /// The slot with another speed of its spindle.
    fn cut(passing_hz: f64) -> Self {
        let slot = Milling::slot();
        let cut = Milling {
            spindle_rpm: 60.0 * passing_hz / f64::from(slot.teeth),
            ..slot
        };
        let case = Self::sine(format!("slot at {passing_hz} Hz"), nominal());
        Self {
            phase: case.phase.loaded(Load::Milling {
                cut,
                component: Component::Normal,
                engaged_s: (0.0, 1e3),
                newtons_per_volt: NEWTONS_PER_VOLT,
            }),
            spindle_hz: Some(passing_hz / f64::from(slot.teeth)),
            ..case
        }
    }

    fn load(frequency_hz: f64) -> Self {
        let load = Load::Sine {
            amplitude_v: LOAD_V,
            frequency_hz,
        };
        Self {
            name: format!("at rest, {LOAD_V} V at {frequency_hz} Hz"),
            phase: Phase {
                motion: MotionSettings::Hold,
                ..Phase::rest(LOADED_S, nominal()).loaded(load)
            },
            scored_s: SCORED_S,
            spindle_hz: None,
        }
    }
}

fn cases() -> Vec<Case> {
    let mut all = vec![
        Case::sine("nominal", nominal()),
        Case::sine("friction x 1.5", nominal().with_friction(1.5)),
    ];
    all.extend(PASSING_HZ.map(Case::cut));
    all.extend(LOADS_HZ.map(Case::load));
    all
}

/// The table of remedies; nothing for an axis without a plant.
pub(super) fn table(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<Option<Table>> {
    let Some(plant) = axis.plant else {
        return Ok(None);
    };
    let rate_hz = stage.rate_hz;
    let omega = Observer::widest(axis, &plant, rate_hz);
    let rows = cases()
        .into_par_iter()
        .map(|case| {
            let mut row = vec![Cell::text(&case.name)];
            for (friction, remedy, _) in COMPETITORS {
                let axis = friction.of(axis);
                let mut addition = addition(remedy, &case, &axis, &plant, omega, rate_hz);
                let phases = std::slice::from_ref(&case.phase);
                // A fault is a result.
                row.push(match run(stage, &axis, phases, &mut *addition, seed) {
                    Ok(traces) => Cell::number(traces[0].largest_um(case.scored_s, rate_hz), 1),
                    Err(error) => Cell::text(error.to_string()),
                });
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let (alone, with) = (
        Observer::peaks(axis, &plant, 0.0, rate_hz),
        Observer::peaks(axis, &plant, omega, rate_hz),
    );
    let mut columns = vec![Column::new("case")];
    columns.extend(COMPETITORS.map(|(_, _, name)| Column::with_unit(name, "um")));
    Ok(Some(Table {
        id: "remedies".to_owned(),
        caption: format!(
            "Simulated. Largest errors under PID: of the last cycle of a sine (30 mm, 10 mm/s), or at rest. The observer has {omega:.0} rad/s: \
             |S| {:.2} -> {:.2}, |T| {:.2} -> {:.2}",
            alone.0, with.0, alone.1, with.1
        ),
        columns,
        rows,
    }))
}

fn addition(
    remedy: Remedy,
    case: &Case,
    axis: &AxisSettings,
    plant: &PlantModel,
    omega: f64,
    rate_hz: f64,
) -> Box<dyn Addition> {
    match (remedy, case.spindle_hz) {
        (Remedy::None, _) | (Remedy::Spindle, None) => Box::new(Nothing),
        (Remedy::Observer, _) => Box::new(Observer::new(axis, plant, omega, rate_hz)),
        (Remedy::Fed, _) => Box::new(FedFriction::new(axis, rate_hz)),
        (Remedy::Spindle, Some(hz)) => Box::new(Cancelling::new(
            axis,
            plant,
            &[hz, 2.0 * hz, 4.0 * hz],
            CANCELLING_PER_S,
            rate_hz,
        )),
    }
}
