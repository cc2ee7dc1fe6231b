//! Every number of the feedback laws beside PID and N-PID, with values just outside its range.

use quadrant_law::control::nctf::NctfGains;
use quadrant_law::control::schedule::SchedulePoint;
use quadrant_settings::AxisSettings;

use crate::fields::Field;

/// As [`crate::fields::FIELDS`].
pub(crate) const LAW_FIELDS: &[(&str, Field, f64, f64)] = &[
    (
        "feedback.schedule.speed_mm_s",
        |a| &mut schedule(a)[0].speed_mm_s,
        -0.1,
        0.1,
    ),
    (
        "feedback.schedule.proportional",
        |a| &mut schedule(a)[0].proportional,
        -0.1,
        30.1,
    ),
    (
        "feedback.schedule.integral",
        |a| &mut schedule(a)[0].integral,
        -0.1,
        30.1,
    ),
    (
        "feedback.schedule.derivative",
        |a| &mut schedule(a)[0].derivative,
        -0.1,
        30.1,
    ),
    (
        "feedback.cascade.position_gain_per_s",
        |a| {
            &mut a
                .feedback
                .cascade
                .as_mut()
                .expect("by default")
                .position_gain_per_s
        },
        0.0,
        1.1e4,
    ),
    (
        "feedback.cascade.velocity_gain_v_s_per_mm",
        |a| {
            &mut a
                .feedback
                .cascade
                .as_mut()
                .expect("by default")
                .velocity_gain_v_s_per_mm
        },
        0.0,
        101.0,
    ),
    (
        "feedback.cascade.velocity_integral_per_s",
        |a| {
            &mut a
                .feedback
                .cascade
                .as_mut()
                .expect("by default")
                .velocity_integral_per_s
        },
        -0.1,
        1.1e4,
    ),
    (
        "feedback.cascade.velocity_feedforward",
        |a| {
            &mut a
                .feedback
                .cascade
                .as_mut()
                .expect("by default")
                .velocity_feedforward
        },
        -0.1,
        1.1,
    ),
    (
        "feedback.cascade.velocity_limit_mm_s",
        |a| {
            &mut a
                .feedback
                .cascade
                .as_mut()
                .expect("by default")
                .velocity_limit_mm_s
        },
        0.0,
        1001.0,
    ),
    (
        "feedback.sliding_mode.slope_per_s",
        |a| {
            &mut a
                .feedback
                .sliding_mode
                .as_mut()
                .expect("by default")
                .slope_per_s
        },
        0.0,
        1.1e4,
    ),
    (
        "feedback.sliding_mode.switching_v",
        |a| {
            &mut a
                .feedback
                .sliding_mode
                .as_mut()
                .expect("by default")
                .switching_v
        },
        0.0,
        10.1,
    ),
    (
        "feedback.sliding_mode.boundary_mm_s",
        |a| {
            &mut a
                .feedback
                .sliding_mode
                .as_mut()
                .expect("by default")
                .boundary_mm_s
        },
        0.0,
        1001.0,
    ),
    (
        "feedback.sliding_mode.integral_per_s",
        |a| {
            &mut a
                .feedback
                .sliding_mode
                .as_mut()
                .expect("by default")
                .integral_per_s
        },
        -0.1,
        1.1e4,
    ),
    (
        "feedback.nctf.characteristic.error_mm",
        |a| &mut nctf(a).characteristic[0].error_mm,
        0.0,
        30.1,
    ),
    (
        "feedback.nctf.characteristic.velocity_mm_s",
        |a| &mut nctf(a).characteristic[0].velocity_mm_s,
        0.0,
        1001.0,
    ),
    (
        "feedback.nctf.gain_v_s_per_mm",
        |a| &mut nctf(a).gain_v_s_per_mm,
        0.0,
        101.0,
    ),
    (
        "feedback.nctf.integral_per_s",
        |a| &mut nctf(a).integral_per_s,
        -0.1,
        1.1e4,
    ),
];

fn schedule(axis: &mut AxisSettings) -> &mut [SchedulePoint] {
    axis.feedback.schedule.as_mut().expect("by default")
}

fn nctf(axis: &mut AxisSettings) -> &mut NctfGains {
    axis.feedback.nctf.as_mut().expect("by default")
}
