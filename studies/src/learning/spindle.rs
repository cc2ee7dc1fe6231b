//! The slot with cancelling, whose speed setting differs from the spindle's, or passes it in a ramp.

use quadrant_law::cancelling::CancellingSettings;
use quadrant_report::{Cell, Column, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::cutting::Milling;
use rayon::prelude::*;

use super::run::{Phase, SINE, cycle_s, nominal, run, slot, under_pid};
use crate::competitor::Feedforward;

/// Cycles of the sine; all but the first are scored, because a ramp lasts long.
const CYCLES: f64 = 3.25;
/// Errors of the speed setting, %.
const SPEED_ERRORS: [f64; 7] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, -1.0];
/// Rates of a ramp through the spindle's speed, rpm/s.
const RAMPS_RPM_S: [f64; 3] = [100.0, 1000.0, 10_000.0];
/// Ends of this ramp, rpm; the slot is milled at 3000.
const RAMP_RPM: [f64; 2] = [600.0, 6000.0];
/// Rate of a change of the speed that is no ramp, rpm/s.
const AT_ONCE_RPM_S: f64 = 1e4;

/// A run: its name, the speed setting at first and from the start of the motion on, rpm, and the rate of the change, rpm/s.
type Case = (String, [f64; 2], f64);

fn cases() -> Vec<Case> {
    let mut all = vec![("off".to_owned(), [0.0; 2], AT_ONCE_RPM_S)];
    all.extend(SPEED_ERRORS.map(|percent| {
        let rpm = Milling::slot().spindle_rpm * (1.0 + percent / 100.0);
        (format!("set {percent:+} %"), [rpm; 2], AT_ONCE_RPM_S)
    }));
    let [low, high] = RAMP_RPM;
    for ramp in RAMPS_RPM_S {
        for [from, to] in [[low, high], [high, low]] {
            let name = format!("{from:.0} to {to:.0} rpm at {ramp:.0} rpm/s");
            all.push((name, [from, to], ramp));
        }
    }
    all
}

/// The table of speeds.
///
/// # Errors
/// Settings that are refused, such as those of an axis without a plant.
pub(super) fn table(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<Table> {
    let rate_hz = stage.rate_hz;
    let scored_s = (CYCLES - 1.0) * cycle_s(SINE);
    let rows = cases()
        .into_par_iter()
        .map(|(name, [spindle_rpm, set_rpm], ramp_rpm_s)| {
            let mut row = vec![Cell::text(name)];
            for feedforward in Feedforward::ALL {
                let mut axis = under_pid(axis, feedforward);
                axis.feedforward.cancelling = Some(CancellingSettings {
                    spindle_rpm,
                    ramp_rpm_s,
                    ..CancellingSettings::default()
                });
                let mut phase = Phase::sine(SINE, CYCLES, nominal()).loaded(slot(Milling::slot()));
                phase.spindle_rpm = Some(set_rpm);
                let traces = run(stage, &axis, &[phase], seed)?;
                row.push(Cell::number(traces[0].largest_um(scored_s, rate_hz), 1));
                row.push(Cell::number(traces[0].rms_um(scored_s, rate_hz), 1));
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let mut columns = vec![Column::new("spindle")];
    for name in Feedforward::ALL.map(Feedforward::name) {
        columns.push(Column::with_unit(name, "um"));
        columns.push(Column::with_unit(format!("{name}, RMS"), "um"));
    }
    Ok(Table {
        id: "spindle".to_owned(),
        caption: "Simulated. The slot with cancelling, its speed setting unlike the spindle's, and led through it by a ramp: \
                  largest and RMS errors after the first cycle, feedforward without, fixed and learning"
            .to_owned(),
        columns,
        rows,
    })
}
