//! Every number of an axis' settings, with values just outside its range.

use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::AxisSettings;

pub(crate) type Field = fn(&mut AxisSettings) -> &mut f64;

/// Every number of an axis: its path, where it is, and values just outside its range at 10 kHz by default.
pub(crate) const FIELDS: &[(&str, Field, f64, f64)] = &[
    (
        "encoder.resolution_mm",
        |a| &mut a.encoder.resolution_mm,
        0.9e-6,
        1.1,
    ),
    (
        "amplifier.full_scale_v",
        |a| &mut a.amplifier.full_scale_v,
        0.09,
        21.0,
    ),
    (
        "amplifier.output_limit_v",
        |a| &mut a.amplifier.output_limit_v,
        0.0,
        10.1,
    ),
    (
        "amplifier.offset_v",
        |a| &mut a.amplifier.offset_v,
        -1.01,
        1.01,
    ),
    (
        "limits.max_velocity_mm_s",
        |a| &mut a.limits.max_velocity_mm_s,
        0.0,
        1001.0,
    ),
    (
        "limits.max_acceleration_mm_s2",
        |a| &mut a.limits.max_acceleration_mm_s2,
        0.0,
        3.1e4,
    ),
    (
        "limits.following_error_mm",
        |a| &mut a.limits.following_error_mm,
        4e-4,
        20.1,
    ),
    (
        "limits.following_error_lag_s",
        |a| &mut a.limits.following_error_lag_s,
        -1e-9,
        1.1,
    ),
    (
        "limits.following_error_max_mm",
        |a| &mut a.limits.following_error_max_mm,
        0.99,
        20.1,
    ),
    (
        "limits.overspeed_ratio",
        |a| &mut a.limits.overspeed_ratio,
        1.04,
        2.1,
    ),
    (
        "limits.braking_mm_s2",
        |a| &mut a.limits.braking_mm_s2,
        0.0,
        3.1e4,
    ),
    (
        "limits.max_jerk_mm_s3",
        |a| &mut a.limits.max_jerk_mm_s3,
        0.9,
        1.1e9,
    ),
    (
        "homing.search_mm_s",
        |a| &mut homing(a).search_mm_s,
        0.9e-3,
        1001.0,
    ),
    (
        "homing.latch_mm_s",
        |a| &mut homing(a).latch_mm_s,
        0.9e-3,
        20.1,
    ),
    (
        "homing.debounce_s",
        |a| &mut homing(a).debounce_s,
        -1e-6,
        0.101,
    ),
    (
        "homing.mark_mm",
        |a| &mut homing(a).mark_mm,
        -1.01e4,
        1.01e4,
    ),
    (
        "homing.park_mm",
        |a| &mut homing(a).park_mm,
        -1.01e4,
        1.01e4,
    ),
    (
        "homing.travel_mm",
        |a| &mut homing(a).travel_mm,
        4e-4,
        2.01e4,
    ),
    (
        "limits.braking_jerk_mm_s3",
        |a| &mut a.limits.braking_jerk_mm_s3,
        0.9,
        1.1e9,
    ),
    (
        "amplifier.continuous_v",
        |a| &mut a.amplifier.continuous_v,
        0.9e-3,
        20.1,
    ),
    (
        "amplifier.overload_s",
        |a| &mut a.amplifier.overload_s,
        0.009,
        1001.0,
    ),
    ("limits.silent_s", |a| &mut a.limits.silent_s, 0.9e-4, 10.1),
    (
        "limits.silent_share",
        |a| &mut a.limits.silent_share,
        0.009,
        1.01,
    ),
    (
        "limits.travel_mm.negative",
        |a| &mut travel(a).negative,
        -1.01e4,
        1.01e4,
    ),
    (
        "limits.travel_mm.positive",
        |a| &mut travel(a).positive,
        -200.0,
        1.01e4,
    ),
    (
        "plant.gain_mm_per_v_s2",
        |a| &mut plant(a).gain_mm_per_v_s2,
        0.0,
        2e9,
    ),
    (
        "plant.damping_per_s",
        |a| &mut plant(a).damping_per_s,
        -1.0,
        2e6,
    ),
    (
        "plant.stiffness_per_s2",
        |a| &mut plant(a).stiffness_per_s2,
        -1.0,
        2e9,
    ),
    ("plant.delay_s", |a| &mut plant(a).delay_s, -1e-4, 0.2),
    (
        "feedback.pid.kp_v_per_mm",
        |a| &mut a.feedback.pid.kp_v_per_mm,
        -0.1,
        1.1e4,
    ),
    (
        "feedback.pid.ki_v_per_mm_s",
        |a| &mut a.feedback.pid.ki_v_per_mm_s,
        -0.1,
        1.1e6,
    ),
    (
        "feedback.pid.kd_v_s_per_mm",
        |a| &mut a.feedback.pid.kd_v_s_per_mm,
        -0.1,
        101.0,
    ),
    (
        "feedback.pid.derivative_filter_s",
        |a| &mut a.feedback.pid.derivative_filter_s,
        49e-6,
        1.1,
    ),
    (
        "feedback.integral_limit_v",
        |a| &mut a.feedback.integral_limit_v,
        0.0,
        10.1,
    ),
    (
        "feedback.transfer_s",
        |a| &mut a.feedback.transfer_s,
        0.9e-3,
        11.0,
    ),
    (
        "feedback.nonlinear.range_mm",
        |a| &mut nonlinear(a).range_mm,
        0.9e-3,
        11.0,
    ),
    (
        "feedback.nonlinear.rate_per_mm",
        |a| &mut nonlinear(a).rate_per_mm,
        -0.1,
        34.1,
    ),
    (
        "feedforward.gains.level",
        |a| &mut a.feedforward.gains.level,
        -0.1,
        2.1,
    ),
    (
        "feedforward.gains.viscous",
        |a| &mut a.feedforward.gains.viscous,
        -0.1,
        2.1,
    ),
    (
        "feedforward.gains.presliding",
        |a| &mut a.feedforward.gains.presliding,
        -0.1,
        2.1,
    ),
    (
        "feedforward.gains.inertia_v_s2_per_mm",
        |a| &mut a.feedforward.gains.inertia_v_s2_per_mm,
        -0.1,
        1.1,
    ),
    (
        "feedforward.preview_s",
        |a| &mut a.feedforward.preview_s,
        -1e-4,
        3.2e-3,
    ),
    (
        "friction.sliding.positive.curve.coulomb_v",
        |a| &mut a.friction.sliding.positive.curve.coulomb_v,
        0.0,
        11.0,
    ),
    (
        "friction.sliding.positive.curve.breakaway_v",
        |a| &mut a.friction.sliding.positive.curve.breakaway_v,
        0.0119,
        11.0,
    ),
    (
        "friction.sliding.positive.curve.stribeck_velocity_mm_s",
        |a| &mut a.friction.sliding.positive.curve.stribeck_velocity_mm_s,
        0.9e-3,
        1001.0,
    ),
    (
        "friction.sliding.positive.curve.exponent",
        |a| &mut a.friction.sliding.positive.curve.exponent,
        0.2,
        4.1,
    ),
    (
        "friction.sliding.positive.viscous_v_s_per_mm",
        |a| &mut a.friction.sliding.positive.viscous_v_s_per_mm,
        -0.1,
        1.1,
    ),
    (
        "friction.sliding.negative.curve.coulomb_v",
        |a| &mut a.friction.sliding.negative.curve.coulomb_v,
        0.0,
        11.0,
    ),
    (
        "friction.sliding.negative.curve.breakaway_v",
        |a| &mut a.friction.sliding.negative.curve.breakaway_v,
        0.0119,
        11.0,
    ),
    (
        "friction.sliding.negative.curve.stribeck_velocity_mm_s",
        |a| &mut a.friction.sliding.negative.curve.stribeck_velocity_mm_s,
        0.9e-3,
        1001.0,
    ),
    (
        "friction.sliding.negative.curve.exponent",
        |a| &mut a.friction.sliding.negative.curve.exponent,
        0.2,
        4.1,
    ),
    (
        "friction.sliding.negative.viscous_v_s_per_mm",
        |a| &mut a.friction.sliding.negative.viscous_v_s_per_mm,
        -0.1,
        1.1,
    ),
    (
        "friction.gms.elements.stiffness_v_per_mm",
        |a| &mut a.friction.gms.elements[2].stiffness_v_per_mm,
        0.0,
        1.1e5,
    ),
    (
        "friction.gms.elements.weight",
        |a| &mut a.friction.gms.elements[1].weight,
        -0.1,
        1.1,
    ),
    (
        "friction.gms.attraction_v_s",
        |a| &mut a.friction.gms.attraction_v_s,
        -0.1,
        1.1e6,
    ),
    (
        "friction.smoothed_gms.width",
        |a| &mut a.friction.smoothed_gms.width,
        9e-4,
        1.1,
    ),
    (
        "friction.dahl.stiffness_v_per_mm",
        |a| &mut dahl(a).stiffness_v_per_mm,
        9e-7,
        1.1e5,
    ),
    (
        "friction.dahl.exponent",
        |a| &mut dahl(a).exponent,
        0.99,
        3.1,
    ),
    (
        "friction.lugre.stiffness_v_per_mm",
        |a| &mut lugre(a).stiffness_v_per_mm,
        9e-7,
        1.1e5,
    ),
    (
        "friction.lugre.damping_v_s_per_mm",
        |a| &mut lugre(a).damping_v_s_per_mm,
        -1e-9,
        1.1,
    ),
];

fn dahl(axis: &mut AxisSettings) -> &mut quadrant_law::friction::dahl::DahlParameters {
    axis.friction.dahl.as_mut().expect("a model by default")
}

fn lugre(axis: &mut AxisSettings) -> &mut quadrant_law::friction::lugre::LugreParameters {
    axis.friction.lugre.as_mut().expect("a model by default")
}

fn travel(axis: &mut AxisSettings) -> &mut quadrant_settings::TravelSettings {
    axis.limits.travel_mm.as_mut().expect("by default")
}

fn homing(axis: &mut AxisSettings) -> &mut quadrant_settings::HomingSettings {
    axis.homing.as_mut().expect("by default")
}

fn plant(axis: &mut AxisSettings) -> &mut PlantModel {
    axis.plant.as_mut().expect("a plant by default")
}

pub(crate) fn nonlinear(
    axis: &mut AxisSettings,
) -> &mut quadrant_law::control::npid::NonlinearGain {
    axis.feedback
        .nonlinear
        .as_mut()
        .expect("an N-PID by default")
}
