//! The leaves of the feedback laws.

use strum::VariantNames;

use super::row::{LeafInfo, UNSET, at, list, name, number, period_s, point, times};
use super::stage::full_scale_v;
use crate::axis::AxisSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::{filter, nctf, schedule};

/// Largest share of a schedule: what [`quadrant_law::scalar::Quantity::Multiplier`] holds.
const MOST_SHARE: f64 = 30.0;

fn output_limit_v(axis: &AxisSettings, _: f64) -> f64 {
    axis.amplifier.output_limit_v
}

fn rate_hz(_: &AxisSettings, period_s: f64) -> f64 {
    1.0 / period_s
}

/// cosh(3.4) is 15: within the fixed-point format, and far beyond any Popov bound met in practice.
fn steepest_rate_per_mm(axis: &AxisSettings, _: f64) -> f64 {
    let nonlinear = axis.feedback.nonlinear.as_ref();
    nonlinear.map_or(f64::INFINITY, |gain| 3.4 / gain.range_mm)
}

#[rustfmt::skip]
pub(super) const LEAVES: &[LeafInfo] = &[
    name("feedback.law", LawKind::VARIANTS,
        "Law in force; it needs its parameters."),
    number("feedback.integral_limit_v", "V", at(1e-6), times(1.0, "full scale", full_scale_v), 2.0,
        "The integral of any law stays within plus and minus this."),
    number("feedback.transfer_s", "s", at(1e-3), at(10.0), 0.05,
        "Time constant with which the offset of a bumpless change of settings fades."),
    number("feedback.pid.kp_v_per_mm", "V/mm", at(0.0), at(1e4), 0.0,
        "Kp, proportional gain of PD, PID, N-PID and the scheduled PID."),
    number("feedback.pid.ki_v_per_mm_s", "V/(mm s)", at(0.0), at(1e6), 0.0,
        "Ki, integral gain."),
    number("feedback.pid.kd_v_s_per_mm", "V s/mm", at(0.0), at(1e2), 0.0,
        "Kd, derivative gain."),
    number("feedback.pid.derivative_filter_s", "s", times(0.5, "the control period", period_s), at(1.0), 1e-4,
        "Time constant of the derivative's filter, of every law."),
    number("feedback.nonlinear.range_mm", "mm", at(1e-3), at(10.0), 0.1,
        "emax, error above which that gain is constant."),
    number("feedback.nonlinear.rate_per_mm", "1/mm",
        at(0.0), times(1.0, "3.4 / range, and the Popov bound on the plant", steepest_rate_per_mm), 0.0,
        "ko, growth of the N-PID's gain cosh(ko e) with the error."),
    list("feedback.schedule", schedule::MAX_POINTS,
        "The schedule of the scheduled PID: shares of the PID's gains over the reference's speed, straight lines between."),
    point("feedback.schedule.speed_mm_s", "mm/s", at(0.0), at(1e3), 0.0,
        |a, i| Some(a.feedback.schedule.as_ref()?.get(i)?.speed_mm_s),
        "Speed of the reference; zero for the first point, rising from point to point."),
    point("feedback.schedule.proportional", "", at(0.0), at(MOST_SHARE), 1.0,
        |a, i| Some(a.feedback.schedule.as_ref()?.get(i)?.proportional),
        "Share of Kp."),
    point("feedback.schedule.integral", "", at(0.0), at(MOST_SHARE), 1.0,
        |a, i| Some(a.feedback.schedule.as_ref()?.get(i)?.integral),
        "Share of Ki."),
    point("feedback.schedule.derivative", "", at(0.0), at(MOST_SHARE), 1.0,
        |a, i| Some(a.feedback.schedule.as_ref()?.get(i)?.derivative),
        "Share of Kd."),
    number("feedback.cascade.position_gain_per_s", "1/s", at(1e-3), at(1e4), UNSET,
        "Kv, gain of the position loop."),
    number("feedback.cascade.velocity_gain_v_s_per_mm", "V s/mm", at(1e-9), at(1e2), UNSET,
        "G, gain of the velocity loop."),
    number("feedback.cascade.velocity_integral_per_s", "1/s", at(0.0), at(1e4), 0.0,
        "r, reciprocal of the velocity loop's reset time; 0 for a P/P cascade."),
    number("feedback.cascade.velocity_feedforward", "", at(0.0), at(1.0), 1.0,
        "g, share of the reference's velocity that is fed forward to the velocity loop."),
    number("feedback.cascade.velocity_limit_mm_s", "mm/s", at(1e-3), at(1e3), 50.0,
        "Largest velocity command of the position loop."),
    number("feedback.sliding_mode.slope_per_s", "1/s", at(1e-3), at(1e4), UNSET,
        "lambda, slope of the sliding line: on it the error falls as exp(-lambda t)."),
    number("feedback.sliding_mode.switching_v", "V", at(1e-6), times(1.0, "output limit", output_limit_v), UNSET,
        "K, the switching output."),
    number("feedback.sliding_mode.boundary_mm_s", "mm/s", at(1e-3), at(1e3), UNSET,
        "phi, half the thickness of the boundary layer."),
    number("feedback.sliding_mode.integral_per_s", "1/s", at(0.0), at(1e4), 0.0,
        "r, the integral's share."),
    list("feedback.nctf.characteristic", nctf::MAX_POINTS,
        "The nominal characteristic trajectory, from the origin on and constant beyond the last point."),
    point("feedback.nctf.characteristic.error_mm", "mm", at(1e-6), at(30.0), UNSET,
        |a, i| Some(a.feedback.nctf.as_ref()?.characteristic.get(i)?.error_mm),
        "Tracking error at the point; rising from point to point."),
    point("feedback.nctf.characteristic.velocity_mm_s", "mm/s", at(1e-3), at(1e3), UNSET,
        |a, i| Some(a.feedback.nctf.as_ref()?.characteristic.get(i)?.velocity_mm_s),
        "Velocity at the point; never falling from point to point."),
    number("feedback.nctf.gain_v_s_per_mm", "V s/mm", at(1e-9), at(1e2), UNSET,
        "G, gain on the distance from the trajectory."),
    number("feedback.nctf.integral_per_s", "1/s", at(0.0), at(1e4), 0.0,
        "r, the integral's share."),
    list("feedback.filters", filter::MAX_FILTERS,
        "Notches and low-passes behind the law, for an axis with a resonance; every law's."),
    point("feedback.filters.frequency_hz", "Hz", at(1.0), times(0.45, "the control rate", rate_hz), UNSET,
        |a, i| Some(a.feedback.filters.as_ref()?.get(i)?.frequency_hz),
        "Frequency of a notch, corner of a low-pass."),
    point("feedback.filters.damping", "", at(0.1), at(2.0), 0.5,
        |a, i| Some(a.feedback.filters.as_ref()?.get(i)?.damping),
        "Damping ratio of the denominator: half the width of a notch over its frequency."),
    point("feedback.filters.centre_gain", "", at(0.0), at(1.0), 0.1,
        |a, i| Some(a.feedback.filters.as_ref()?.get(i)?.centre_gain),
        "Gain of a notch at its frequency; 0 for a low-pass."),
    point("feedback.filters.high_frequency_gain", "", at(0.0), at(1.0), 1.0,
        |a, i| Some(a.feedback.filters.as_ref()?.get(i)?.high_frequency_gain),
        "Gain far above the frequency: 1 for a notch, 0 for a low-pass."),
];
