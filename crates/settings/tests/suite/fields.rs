//! Every number of an axis' settings, with values just outside its range.

use quadrant_law::axes::AxisName;
use quadrant_settings::{AxisSettings, StageSettings};

/// Every number of an axis: its path, and values just outside its range at 10 kHz by default.
pub(crate) const FIELDS: &[(&str, f64, f64)] = &[
    ("encoder.resolution_mm", 0.9e-6, 1.1),
    ("amplifier.full_scale_v", 0.09, 21.0),
    ("amplifier.output_limit_v", 0.0, 10.1),
    ("amplifier.offset_v", -1.01, 1.01),
    ("limits.max_velocity_mm_s", 0.0, 1001.0),
    ("limits.max_acceleration_mm_s2", 0.0, 3.1e4),
    ("limits.following_error_mm", 4e-4, 20.1),
    ("limits.following_error_lag_s", -1e-9, 1.1),
    ("limits.following_error_max_mm", 0.99, 20.1),
    ("limits.overspeed_ratio", 1.04, 2.1),
    ("limits.braking_mm_s2", 0.0, 3.1e4),
    ("limits.max_jerk_mm_s3", 0.9, 1.1e9),
    ("homing.search_mm_s", 0.9e-3, 1001.0),
    ("homing.latch_mm_s", 0.9e-3, 20.1),
    ("homing.debounce_s", -1e-6, 0.101),
    ("homing.mark_mm", -1.01e4, 1.01e4),
    ("homing.park_mm", -1.01e4, 1.01e4),
    ("homing.travel_mm", 4e-4, 2.01e4),
    ("limits.braking_jerk_mm_s3", 0.9, 1.1e9),
    ("amplifier.continuous_v", 0.9e-3, 20.1),
    ("amplifier.overload_s", 0.009, 1001.0),
    ("limits.silent_s", 0.9e-4, 10.1),
    ("limits.silent_share", 0.009, 1.01),
    ("limits.travel_mm.negative", -1.01e4, 1.01e4),
    ("limits.travel_mm.positive", -200.0, 1.01e4),
    ("plant.gain_mm_per_v_s2", 0.0, 2e9),
    ("plant.damping_per_s", -1.0, 2e6),
    ("plant.stiffness_per_s2", -1.0, 2e9),
    ("plant.delay_s", -1e-4, 0.2),
    ("feedback.pid.kp_v_per_mm", -0.1, 1.1e4),
    ("feedback.pid.ki_v_per_mm_s", -0.1, 1.1e6),
    ("feedback.pid.kd_v_s_per_mm", -0.1, 101.0),
    ("feedback.pid.derivative_filter_s", 49e-6, 1.1),
    ("feedback.integral_limit_v", 0.0, 10.1),
    ("feedback.transfer_s", 0.9e-3, 11.0),
    ("feedback.nonlinear.range_mm", 0.9e-3, 11.0),
    ("feedback.nonlinear.rate_per_mm", -0.1, 34.1),
    ("feedforward.gains.level", -0.1, 2.1),
    ("feedforward.gains.viscous", -0.1, 2.1),
    ("feedforward.gains.presliding", -0.1, 2.1),
    ("feedforward.gains.inertia_v_s2_per_mm", -0.1, 1.1),
    ("feedforward.range", 0.009, 100.1),
    ("feedforward.preview_s", -1e-4, 3.2e-3),
    ("feedforward.from_mm_s", -0.1, 1000.1),
    ("feedforward.from_mm", -0.1, 100.1),
    ("friction.sliding.positive.curve.coulomb_v", 0.0, 11.0),
    ("friction.sliding.positive.curve.breakaway_v", 0.0119, 11.0),
    (
        "friction.sliding.positive.curve.stribeck_velocity_mm_s",
        0.9e-3,
        1001.0,
    ),
    ("friction.sliding.positive.curve.exponent", 0.2, 4.1),
    ("friction.sliding.positive.viscous_v_s_per_mm", -0.1, 1.1),
    ("friction.sliding.negative.curve.coulomb_v", 0.0, 11.0),
    ("friction.sliding.negative.curve.breakaway_v", 0.0119, 11.0),
    (
        "friction.sliding.negative.curve.stribeck_velocity_mm_s",
        0.9e-3,
        1001.0,
    ),
    ("friction.sliding.negative.curve.exponent", 0.2, 4.1),
    ("friction.sliding.negative.viscous_v_s_per_mm", -0.1, 1.1),
    ("friction.gms.elements.stiffness_v_per_mm", 0.0, 1.1e5),
    ("friction.gms.elements.weight", -0.1, 1.1),
    ("friction.gms.attraction_v_s", -0.1, 1.1e6),
    ("friction.smoothed_gms.width", 9e-4, 1.1),
    ("friction.dahl.stiffness_v_per_mm", 9e-7, 1.1e5),
    ("friction.dahl.exponent", 0.99, 3.1),
    ("friction.lugre.stiffness_v_per_mm", 9e-7, 1.1e5),
    ("friction.lugre.damping_v_s_per_mm", -1e-9, 1.1),
    ("feedback.schedule.speed_mm_s", -0.1, 0.1),
    ("feedback.schedule.proportional", -0.1, 30.1),
    ("feedback.schedule.integral", -0.1, 30.1),
    ("feedback.schedule.derivative", -0.1, 30.1),
    ("feedback.cascade.position_gain_per_s", 0.0, 1.1e4),
    ("feedback.cascade.velocity_gain_v_s_per_mm", 0.0, 101.0),
    ("feedback.cascade.velocity_integral_per_s", -0.1, 1.1e4),
    ("feedback.cascade.velocity_feedforward", -0.1, 1.1),
    ("feedback.cascade.velocity_limit_mm_s", 0.0, 1001.0),
    ("feedback.sliding_mode.slope_per_s", 0.0, 1.1e4),
    ("feedback.sliding_mode.switching_v", 0.0, 10.1),
    ("feedback.sliding_mode.boundary_mm_s", 0.0, 1001.0),
    ("feedback.sliding_mode.integral_per_s", -0.1, 1.1e4),
    ("feedback.nctf.characteristic.error_mm", 0.0, 30.1),
    ("feedback.nctf.characteristic.velocity_mm_s", 0.0, 1001.0),
    ("feedback.nctf.gain_v_s_per_mm", 0.0, 101.0),
    ("feedback.nctf.integral_per_s", -0.1, 1.1e4),
];

/// A number of an axis by its name in [`FIELDS`]; of a list, that of one of its points.
pub(crate) fn number<'a>(
    settings: &'a mut StageSettings,
    axis: AxisName,
    field: &str,
) -> &'a mut f64 {
    let index = axis as usize;
    let lists = [
        "friction.gms.elements.",
        "feedback.schedule.",
        "feedback.nctf.characteristic.",
    ];
    if lists.iter().any(|list| field.starts_with(list)) {
        return number_of_point(&mut settings.axes[index], field);
    }
    let path = format!("/axes/{index}/{}", field.replace('.', "/"));
    let leaf = settings.leaf_mut(&path).expect("a leaf");
    leaf.downcast_mut().expect("a number")
}

fn number_of_point<'a>(axis: &'a mut AxisSettings, field: &str) -> &'a mut f64 {
    const PRESENT: &str = "by default";
    let elements = &mut axis.friction.gms.elements;
    let (schedule, nctf) = (&mut axis.feedback.schedule, &mut axis.feedback.nctf);
    let scheduled = &mut schedule.as_mut().expect(PRESENT)[0];
    let known = &mut nctf.as_mut().expect(PRESENT).characteristic[0];
    match field {
        "friction.gms.elements.stiffness_v_per_mm" => &mut elements[2].stiffness_v_per_mm,
        "friction.gms.elements.weight" => &mut elements[1].weight,
        "feedback.schedule.speed_mm_s" => &mut scheduled.speed_mm_s,
        "feedback.schedule.proportional" => &mut scheduled.proportional,
        "feedback.schedule.integral" => &mut scheduled.integral,
        "feedback.schedule.derivative" => &mut scheduled.derivative,
        "feedback.nctf.characteristic.error_mm" => &mut known.error_mm,
        "feedback.nctf.characteristic.velocity_mm_s" => &mut known.velocity_mm_s,
        other => panic!("{other}: no number of a point"),
    }
}
