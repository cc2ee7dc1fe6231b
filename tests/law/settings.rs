//! Settings are refused by name, with the value and what is allowed; good ones survive being stored.

use quadrant::control::plant_model::PlantModel;
use quadrant::friction::gms::GmsElement;
use quadrant::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant::safety::AxisName;
use quadrant::settings::{AxisSettings, PlanSettings, Reason, SettingsError, StageSettings};

use crate::common::with_x;

const ROOM: usize = 4;

type Field = fn(&mut AxisSettings) -> &mut f64;

/// Every number of an axis: its path, where it is, and values just outside its range at 10 kHz by default.
const FIELDS: &[(&str, Field, f64, f64)] = &[
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
        "feedforward.gains.gms",
        |a| &mut a.feedforward.gains.gms,
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
        0.119,
        11.0,
    ),
    (
        "friction.sliding.positive.curve.stribeck_velocity_mm_s",
        |a| &mut a.friction.sliding.positive.curve.stribeck_velocity_mm_s,
        0.9e-3,
        101.0,
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
        0.119,
        11.0,
    ),
    (
        "friction.sliding.negative.curve.stribeck_velocity_mm_s",
        |a| &mut a.friction.sliding.negative.curve.stribeck_velocity_mm_s,
        0.9e-3,
        101.0,
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
];

fn plant(axis: &mut AxisSettings) -> &mut PlantModel {
    axis.plant.as_mut().expect("a plant by default")
}

fn nonlinear(axis: &mut AxisSettings) -> &mut quadrant::control::npid::NonlinearGain {
    axis.feedback
        .nonlinear
        .as_mut()
        .expect("an N-PID by default")
}

fn refusal(settings: &StageSettings) -> SettingsError {
    settings.validate(ROOM).expect_err("refused")
}

/// Checks that the message names everything a person needs.
fn check_message(error: &SettingsError, axis: AxisName, field: &str) {
    assert_eq!((error.axis, error.field), (Some(axis), field));
    let text = error.to_string();
    assert!(
        text.starts_with(&format!("{axis}.{field} = {}", error.value)),
        "{text}"
    );
    if let Reason::OutOfRange { least, most } = error.reason {
        assert!(
            text.ends_with(&format!("is outside {least} to {most}")),
            "{text}"
        );
    }
}

#[test]
fn every_number_out_of_its_range_is_refused_by_name_on_every_axis() {
    for (index, name) in AxisName::ALL.into_iter().enumerate() {
        for &(field, place, below, above) in FIELDS {
            for value in [below, above] {
                let mut settings = StageSettings::default();
                // Below breakaway is above x's coulomb level; other axes have other levels.
                settings.axes[index] = quadrant::settings::x_axis();
                *place(&mut settings.axes[index]) = value;
                let error = refusal(&settings);
                check_message(&error, name, field);
                assert_eq!(error.value, value, "{field}");
                let outside = matches!(error.reason, Reason::OutOfRange { least, most }
                    if value < least || value > most);
                assert!(outside, "{field}: {error}");
            }
        }
    }
}

#[test]
fn every_number_that_is_not_finite_is_refused_by_name() {
    for &(field, place, ..) in FIELDS {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let settings = with_x(|axis| *place(axis) = value);
            let error = refusal(&settings);
            check_message(&error, AxisName::X, field);
            assert_eq!(error.reason, Reason::NotFinite, "{field}");
        }
    }
}

#[test]
fn the_list_of_fields_is_complete() {
    fn numbers(value: &serde_json::Value) -> usize {
        match value {
            serde_json::Value::Number(_) => 1,
            serde_json::Value::Array(items) => items.iter().map(numbers).sum(),
            serde_json::Value::Object(fields) => fields.values().map(numbers).sum(),
            _ => 0,
        }
    }
    let axis = quadrant::settings::x_axis();
    let elements = axis.friction.gms.elements.len();
    let stored = numbers(&serde_json::to_value(&axis).expect("plain data"));
    // One element stands for all; the counter's width is no f64.
    assert_eq!(stored, FIELDS.len() + 2 * (elements - 1) + 1);
}

#[test]
fn the_control_rate_and_the_counter_width_have_ranges() {
    for rate_hz in [999.0, 1.01e5, f64::NAN] {
        let settings = StageSettings {
            rate_hz,
            ..StageSettings::default()
        };
        let error = refusal(&settings);
        assert_eq!((error.axis, error.field), (None, "rate_hz"));
        assert!(error.to_string().starts_with("rate_hz = "), "{error}");
    }
    for bits in [0, 7, 33, 255] {
        let error = refusal(&with_x(|axis| axis.encoder.counter_bits = bits));
        check_message(&error, AxisName::X, "encoder.counter_bits");
    }
}

#[test]
fn defaults_are_valid_at_every_rate_they_claim_and_with_room() {
    assert_eq!(StageSettings::default().validate(4), Ok(()));
    assert_eq!(StageSettings::default().validate(10), Ok(()));
    assert_eq!(
        PlanSettings::default().validate(&StageSettings::default()),
        Ok(())
    );
}

fn reason(change: impl FnOnce(&mut AxisSettings)) -> (&'static str, Reason, String) {
    let error = refusal(&with_x(change));
    assert_eq!(error.axis, Some(AxisName::X));
    (error.field, error.reason, error.to_string())
}

#[test]
fn weights_that_do_not_sum_to_one_are_refused() {
    let (field, reason, text) = reason(|axis| axis.friction.gms.elements[0].weight -= 2e-6);
    assert_eq!(
        (field, reason),
        ("friction.gms.elements.weight", Reason::WeightsSum)
    );
    assert!(
        text.contains("0.999998") && text.contains("sum to 1"),
        "{text}"
    );
    let near = with_x(|axis| axis.friction.gms.elements[0].weight -= 0.5e-6);
    assert_eq!(near.validate(ROOM), Ok(()));
}

#[test]
fn elements_must_fit_the_room_and_exist() {
    let split = |count: usize| {
        let mut settings = StageSettings::default();
        for axis in &mut settings.axes {
            axis.friction.gms.elements = (0..count)
                .map(|_| GmsElement {
                    stiffness_v_per_mm: 1.0,
                    weight: 1.0 / count as f64,
                })
                .collect();
        }
        settings
    };
    assert_eq!(split(5).validate(10), Ok(()));
    assert_eq!(split(10).validate(10), Ok(()));
    assert_eq!(split(1).validate(1), Ok(()));
    let error = refusal(&split(5));
    assert_eq!(error.reason, Reason::TooManyElements { room: 4 });
    assert!(error.to_string().contains("room for 4"), "{error}");
    assert_eq!(refusal(&split(0)).field, "friction.gms.elements");
    assert!(split(5).build::<f32, 4>().is_err());
    assert!(split(5).build::<f32, 5>().is_ok());
}

#[test]
fn nonlinear_gain_beyond_the_popov_bound_is_refused_when_a_plant_is_given() {
    let steep = |axis: &mut AxisSettings| nonlinear(axis).rate_per_mm = 25.0;
    let (field, reason, text) = reason(steep);
    assert_eq!(field, "feedback.nonlinear.rate_per_mm");
    let Reason::BeyondPopov { bound } = reason else {
        panic!("{reason:?}");
    };
    assert!((2.5..3.5).contains(&bound), "{bound}");
    assert!(text.contains(&format!("{bound:.3}")), "{text}");
    let unknown = with_x(|axis| {
        steep(axis);
        axis.plant = None;
    });
    assert_eq!(unknown.validate(ROOM), Ok(()));
    // Just within.
    let within = with_x(|axis| nonlinear(axis).rate_per_mm = (bound * 0.999).acosh() / 0.1);
    assert_eq!(within.validate(ROOM), Ok(()));
}

#[test]
fn stiffness_beyond_what_the_rate_resolves_is_refused_when_a_plant_is_given() {
    let stiff = |axis: &mut AxisSettings| axis.friction.gms.elements[0].stiffness_v_per_mm = 1000.0;
    let (field, reason, text) = reason(stiff);
    assert_eq!(field, "friction.gms.elements.stiffness_v_per_mm");
    let Reason::TooStiffForRate { most } = reason else {
        panic!("{reason:?}");
    };
    // (0.5 / Ts)^2 / A.
    assert!((most - 25e6 / 69_390.0).abs() < 1e-9, "{most}");
    assert!(text.contains(&format!("{most:.4}")), "{text}");
    let unknown = with_x(|axis| {
        stiff(axis);
        axis.plant = None;
    });
    assert_eq!(unknown.validate(ROOM), Ok(()));
    let slower = StageSettings {
        rate_hz: 2e3,
        ..with_x(|axis| axis.feedback.pid.derivative_filter_s = 1e-3)
    };
    assert!(slower.validate(ROOM).is_err());
}

#[test]
fn attraction_faster_than_the_rate_is_refused() {
    let (field, reason, text) = reason(|axis| axis.friction.gms.attraction_v_s = 1201.0);
    assert_eq!(field, "friction.gms.attraction_v_s");
    let Reason::TooFastForRate { most } = reason else {
        panic!("{reason:?}");
    };
    assert!((most - 0.12 / 1e-4).abs() < 1e-9, "{most}");
    assert!(text.contains(&format!("{most:.4}")), "{text}");
}

#[test]
fn a_curve_too_sharp_for_its_table_is_refused() {
    let (field, reason, text) = reason(|axis| {
        let curve = &mut axis.friction.sliding.negative.curve;
        curve.exponent = 0.3;
        curve.coulomb_v = 0.01;
    });
    assert_eq!(field, "friction.sliding.negative.curve.exponent");
    assert_eq!(reason, Reason::TableError);
    assert!(text.contains("0.3") && text.contains("0.1 %"), "{text}");
}

#[test]
fn fast_references_must_fit_the_encoder() {
    // An 8-bit counter at 5 um a count: half its range in a tick is 0.64 mm.
    let narrow = with_x(|axis| {
        axis.encoder.counter_bits = 8;
        axis.encoder.resolution_mm = 1e-5;
    });
    let error = refusal(&narrow);
    check_message(&error, AxisName::X, "limits.max_velocity_mm_s");
    // 4096 counts a tick is the most that the reference's formats hold.
    let fine = with_x(|axis| axis.encoder.resolution_mm = 1e-6);
    check_message(&refusal(&fine), AxisName::X, "limits.max_velocity_mm_s");
}

#[test]
fn following_error_must_fit_the_position_difference() {
    let fine = with_x(|axis| {
        axis.encoder.resolution_mm = 1e-6;
        axis.limits.max_velocity_mm_s = 10.0;
        axis.limits.max_acceleration_mm_s2 = 100.0;
        axis.limits.following_error_mm = 17.0;
    });
    check_message(&refusal(&fine), AxisName::X, "limits.following_error_mm");
}

fn plan_refusal(motion: MotionSettings) -> SettingsError {
    let mut plan = PlanSettings::default();
    plan.motions[1] = motion;
    plan.validate(&StageSettings::default())
        .expect_err("refused")
}

#[test]
fn every_number_of_a_motion_is_refused_by_name() {
    type SineField = fn(&mut HarmonicSettings) -> &mut f64;
    let sine = HarmonicSettings::with_velocity(30.0, 10.0, 2.0, 0.5);
    let fields: [(&str, SineField, f64, f64); 4] = [
        ("motion.amplitude_mm", |s| &mut s.amplitude_mm, 0.0, 1.1e4),
        ("motion.frequency_hz", |s| &mut s.frequency_hz, 0.0, 501.0),
        ("motion.phase_rad", |s| &mut s.phase_rad, -101.0, 101.0),
        ("motion.lead_s", |s| &mut s.lead_s, 0.9e-4, 101.0),
    ];
    for (field, place, below, above) in fields {
        for value in [below, above, f64::NAN, f64::INFINITY] {
            let mut sine = sine;
            *place(&mut sine) = value;
            check_message(
                &plan_refusal(MotionSettings::Harmonic(sine)),
                AxisName::Y,
                field,
            );
        }
    }
    for cycles in [-0.1, 1e9, f64::NAN] {
        let sine = HarmonicSettings {
            cycles: Some(cycles),
            ..sine
        };
        let error = plan_refusal(MotionSettings::Harmonic(sine));
        check_message(&error, AxisName::Y, "motion.cycles");
    }

    type MoveField = fn(&mut PointToPointSettings) -> &mut f64;
    let to = PointToPointSettings {
        distance_mm: 10.0,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 1000.0,
        max_jerk_mm_s3: 1e5,
    };
    let fields: [(&str, MoveField, f64, f64); 4] = [
        ("motion.distance_mm", |m| &mut m.distance_mm, -1.1e4, 1.1e4),
        (
            "motion.max_velocity_mm_s",
            |m| &mut m.max_velocity_mm_s,
            0.0,
            1001.0,
        ),
        (
            "motion.max_acceleration_mm_s2",
            |m| &mut m.max_acceleration_mm_s2,
            0.0,
            3.1e4,
        ),
        (
            "motion.max_jerk_mm_s3",
            |m| &mut m.max_jerk_mm_s3,
            0.0,
            1.1e9,
        ),
    ];
    for (field, place, below, above) in fields {
        for value in [below, above, f64::NAN, f64::INFINITY] {
            let mut to = to;
            *place(&mut to) = value;
            check_message(
                &plan_refusal(MotionSettings::PointToPoint(to)),
                AxisName::Y,
                field,
            );
        }
    }
}

#[test]
fn motions_faster_than_the_axis_are_refused() {
    let fast = HarmonicSettings::with_velocity(30.0, 251.0, 2.0, 0.5);
    let error = plan_refusal(MotionSettings::Harmonic(fast));
    assert_eq!(error.field, "motion (peak velocity, mm/s)");
    let abrupt = HarmonicSettings::with_velocity(30.0, 200.0, 2.0, 0.1);
    let error = plan_refusal(MotionSettings::Harmonic(abrupt));
    assert_eq!(error.field, "motion (peak acceleration, mm/s^2)");
}

#[test]
fn a_move_longer_than_the_tick_counter_is_refused() {
    let endless = PointToPointSettings {
        distance_mm: 1e4,
        max_velocity_mm_s: 1e-6,
        max_acceleration_mm_s2: 1000.0,
        max_jerk_mm_s3: 1e5,
    };
    let error = plan_refusal(MotionSettings::PointToPoint(endless));
    check_message(&error, AxisName::Y, "motion (duration, s)");
}

#[test]
fn a_travel_beyond_the_references_format_is_refused() {
    let stage = with_x(|axis| {
        axis.encoder.resolution_mm = 1e-6;
        axis.limits.max_velocity_mm_s = 10.0;
        axis.limits.max_acceleration_mm_s2 = 20.0;
    });
    let mut plan = PlanSettings::default();
    let sine = HarmonicSettings::with_velocity(3000.0, 10.0, 1.0, 10.0);
    plan.motions[0] = MotionSettings::Harmonic(sine);
    let error = plan.validate(&stage).expect_err("refused");
    check_message(&error, AxisName::X, "motion.amplitude_mm");
    plan.motions[0] = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: -3000.0,
        max_velocity_mm_s: 10.0,
        max_acceleration_mm_s2: 10.0,
        max_jerk_mm_s3: 10.0,
    });
    let error = plan.validate(&stage).expect_err("refused");
    check_message(&error, AxisName::X, "motion.distance_mm");
}
