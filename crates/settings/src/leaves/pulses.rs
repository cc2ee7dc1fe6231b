//! The leaves of an axis that follows another control's pulses.

use super::row::{
    Exchange, LeafInfo, UNSET, at, at_most, exchanged, flag, number, period_s, times,
};
use crate::axis::AxisSettings;
use quadrant_law::reference::MAX_PULSE_DELAY_TICKS;

/// Length of a step behind the gear: the least, mm, for which sums stay exact to some nanometres in a metre.
const LEAST_STEP_MM: f64 = 1e-5;
/// The most, in counts: what the formats of a displacement hold.
const MOST_STEP_COUNTS: f64 = 1024.0;

/// Length of a step before the gear that is one millimetre behind it.
fn ungeared(axis: &AxisSettings) -> f64 {
    let pulses = axis.pulses.unwrap_or_default();
    f64::from(pulses.gear_denominator) / f64::from(pulses.gear_numerator)
}

fn least_step_mm(axis: &AxisSettings, _: f64) -> f64 {
    LEAST_STEP_MM * ungeared(axis)
}

fn most_step_mm(axis: &AxisSettings, _: f64) -> f64 {
    MOST_STEP_COUNTS * axis.encoder.resolution_mm * ungeared(axis)
}

#[rustfmt::skip]
pub(super) const LEAVES: &[LeafInfo] = &exchanged(Exchange::Disabled, [
    number("pulses.gear_numerator", "", at(1.0), at(1e6), 1.0,
        "Numerator of the electronic gear, by which the length of a step is multiplied."),
    number("pulses.gear_denominator", "", at(1.0), at(1e6), 1.0,
        "Denominator of the electronic gear, by which it is divided."),
    number("pulses.step_mm", "mm",
        times(1.0, "10 nm behind the gear", least_step_mm), at_most(1e3, "1024 counts behind the gear", most_step_mm), UNSET,
        "Length of a step of the control, before the gear; left out with its part, the axis follows no pulses."),
    flag("pulses.reversed",
        "True if a step with the direction line on moves the axis to larger positions."),
    number("pulses.delay_s", "s",
        at(0.0), times(MAX_PULSE_DELAY_TICKS as f64, "the control period", period_s), 6.3e-3,
        "Delay of the reference behind the steps: coarse steps need more. Give all axes the same, or a circle is none."),
]);
