//! Every number out of its range is refused by name, with the value and what is allowed.

use quadrant::control::nctf::NctfGains;
use quadrant::control::plant_model::PlantModel;
use quadrant::control::schedule::SchedulePoint;
use quadrant::safety::AxisName;
use quadrant::settings::{AxisSettings, PlanSettings, Reason, SettingsError, StageSettings};

use crate::common::with_x;

pub(crate) const ROOM: usize = 4;

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

fn dahl(axis: &mut AxisSettings) -> &mut quadrant::friction::dahl::DahlParameters {
    axis.friction.dahl.as_mut().expect("a model by default")
}

fn lugre(axis: &mut AxisSettings) -> &mut quadrant::friction::lugre::LugreParameters {
    axis.friction.lugre.as_mut().expect("a model by default")
}

fn plant(axis: &mut AxisSettings) -> &mut PlantModel {
    axis.plant.as_mut().expect("a plant by default")
}

pub(crate) fn nonlinear(axis: &mut AxisSettings) -> &mut quadrant::control::npid::NonlinearGain {
    axis.feedback
        .nonlinear
        .as_mut()
        .expect("an N-PID by default")
}

fn schedule(axis: &mut AxisSettings) -> &mut [SchedulePoint] {
    axis.feedback.schedule.as_mut().expect("by default")
}

fn nctf(axis: &mut AxisSettings) -> &mut NctfGains {
    axis.feedback.nctf.as_mut().expect("by default")
}

pub(crate) fn refusal(settings: &StageSettings) -> SettingsError {
    settings.validate(ROOM).expect_err("refused")
}

/// Checks that the message names everything a person needs.
pub(crate) fn check_message(error: &SettingsError, axis: AxisName, field: &str) {
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
    let points = axis.feedback.schedule.expect("by default").len();
    // One element and one point stand for all; the counter's width is no f64.
    assert_eq!(
        stored,
        FIELDS.len() + 2 * (elements - 1) + 4 * (points - 1) + 1
    );
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
