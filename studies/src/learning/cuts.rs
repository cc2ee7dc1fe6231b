//! The cut, with what else may be done about it.

use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_report::{Cell, Column, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT};
use rayon::prelude::*;

use super::remedies::{FedFriction, Observer};
use super::run::{Addition, Friction, Nothing, Phase, SINE, cycle_s, run};
use super::starts::nominal;

/// Passing frequencies of the teeth, Hz; the slot's is 100.
const PASSING_HZ: [f64; 9] = [20.0, 35.0, 50.0, 70.0, 100.0, 200.0, 300.0, 500.0, 800.0];

/// Cycles of the sine, the last of which is scored.
const CYCLES: f64 = 3.25;

/// Frequencies of the sinusoidal loads at rest, Hz: those of the compliance.
const LOADS_HZ: [f64; 2] = [5.0, 10.0];
/// Amplitude of these loads, V.
const LOAD_V: f64 = 0.3;

/// Time of a load at rest, s.
const LOADED_S: f64 = 6.0;
/// Last part of it, which is scored, s.
const SCORED_S: f64 = 2.0;

/// Speed of the spindle where nothing is cut, Hz: that of the slot.
const IDLE_HZ: f64 = 50.0;

/// A remedy beside the feedforward: a voltage added to the law's output, or cancelling, a part of the law.
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
    /// Frequency of the spindle, Hz; it has two teeth.
    spindle_hz: f64,
}

impl Case {
    fn sine(name: impl Into<String>, truth: AxisParameters) -> Self {
        Self {
            name: name.into(),
            phase: Phase::sine(SINE, CYCLES, truth),
            scored_s: cycle_s(SINE),
            spindle_hz: IDLE_HZ,
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
            spindle_hz: passing_hz / f64::from(slot.teeth),
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
            phase: Phase::rest(LOADED_S, nominal()).loaded(load),
            scored_s: SCORED_S,
            spindle_hz: IDLE_HZ,
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

/// Errors of the speed setting, %.
const SPEED_ERRORS: [f64; 7] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, -1.0];

/// Rates of a ramp through the spindle's speed, rpm/s.
const RAMPS_RPM_S: [f64; 3] = [100.0, 1000.0, 10_000.0];
/// Ends of this ramp, Hz of the teeth.
const RAMP_HZ: (f64, f64) = (20.0, 200.0);

/// The slot with a spindle whose speed differs from the setting; nothing for an axis without a plant.
pub(super) fn speeds(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<Option<Table>> {
    if axis.plant.is_none() {
        return Ok(None);
    }
    let rate_hz = stage.rate_hz;
    let case = Case::cut(Milling::slot().tooth_passing_hz());
    let setting_rpm = |percent: f64| 60.0 * case.spindle_hz * (1.0 + percent / 100.0);
    let hz_to_rpm = |passing_hz: f64| 60.0 * passing_hz / f64::from(Milling::slot().teeth);
    let (low, high) = (hz_to_rpm(RAMP_HZ.0), hz_to_rpm(RAMP_HZ.1));
    // The name, the speed at first, the speed that is set at the start of the motion, and the rate of the change.
    let mut runs = vec![("off".to_owned(), 0.0, 0.0, 1e4)];
    runs.extend(SPEED_ERRORS.map(|percent| {
        let rpm = setting_rpm(percent);
        (format!("set {percent:+} %"), rpm, rpm, 1e4)
    }));
    for ramp in RAMPS_RPM_S {
        runs.push((
            format!("{low:.0} to {high:.0} rpm at {ramp:.0} rpm/s"),
            low,
            high,
            ramp,
        ));
        runs.push((
            format!("{high:.0} to {low:.0} rpm at {ramp:.0} rpm/s"),
            high,
            low,
            ramp,
        ));
    }
    let rows = runs
        .into_par_iter()
        .map(|(name, first, set, ramp_rpm_s)| {
            let mut row = vec![Cell::text(name)];
            for friction in Friction::ALL {
                let mut axis = friction.of(axis);
                axis.feedforward.cancelling = Some(CancellingSettings {
                    spindle_rpm: first,
                    ramp_rpm_s,
                    ..CancellingSettings::default()
                });
                let mut phase = case.phase.clone();
                phase.spindle_rpm = Some(set);
                match run(stage, &axis, &[phase], &mut Nothing, seed) {
                    Ok(traces) => {
                        // A ramp lasts long: all but the first cycle counts.
                        let seconds = (CYCLES - 1.0) * case.scored_s;
                        row.push(Cell::number(traces[0].largest_um(seconds, rate_hz), 1));
                        row.push(Cell::number(traces[0].rms_um(seconds, rate_hz), 1));
                    }
                    Err(error) => row.extend([Cell::text(error.to_string()), Cell::text("")]),
                }
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let mut columns = vec![Column::new("spindle")];
    for name in ["without", "fixed", "learning"] {
        columns.push(Column::with_unit(name, "um"));
        columns.push(Column::with_unit(format!("{name}, RMS"), "um"));
    }
    Ok(Some(Table {
        id: "spindle".to_owned(),
        caption: "Simulated. The slot with cancelling, its speed setting unlike the spindle's, and led through it by a ramp: \
                  largest and RMS errors after the first cycle, feedforward without, fixed and learning"
            .to_owned(),
        columns,
        rows,
    }))
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
                let mut axis = friction.of(axis);
                if remedy == Remedy::Spindle {
                    axis.feedforward.cancelling = Some(CancellingSettings {
                        spindle_rpm: 60.0 * case.spindle_hz,
                        ..CancellingSettings::default()
                    });
                }
                let mut addition = addition(remedy, &axis, &plant, omega, rate_hz);
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
    axis: &AxisSettings,
    plant: &PlantModel,
    omega: f64,
    rate_hz: f64,
) -> Box<dyn Addition> {
    match remedy {
        Remedy::None | Remedy::Spindle => Box::new(Nothing),
        Remedy::Observer => Box::new(Observer::new(axis, plant, omega, rate_hz)),
        Remedy::Fed => Box::new(FedFriction::new(axis, rate_hz)),
    }
}
