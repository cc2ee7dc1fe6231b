//! Relations that the fields of the settings must keep.

use quadrant_law::axes::AxisName;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::gms::GmsElement;
use quadrant_settings::presets::X_PLANT;
use quadrant_settings::{AxisSettings, Reason, StageSettings};

use crate::whole_set::{ROOM, check_message, refusal};
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::nctf::CharacteristicPoint;
use quadrant_test_support::with_x;

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
        let mut settings = StageSettings::simulated();
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
    let steep = |axis: &mut AxisSettings| {
        axis.feedback
            .nonlinear
            .as_mut()
            .expect("by default")
            .rate_per_mm = 25.0
    };
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
    let within = with_x(|axis| {
        axis.feedback
            .nonlinear
            .as_mut()
            .expect("by default")
            .rate_per_mm = (bound * 0.999).acosh() / 0.1
    });
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
    assert!(
        (most - 25e6 / X_PLANT.gain_mm_per_v_s2).abs() < 1e-9,
        "{most}"
    );
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
fn bristles_stiffer_than_the_rate_resolves_are_refused() {
    let most = 25e6 / X_PLANT.gain_mm_per_v_s2;
    for (expected, stiff) in [
        (
            "friction.dahl.stiffness_v_per_mm",
            with_x(|axis| axis.friction.dahl.as_mut().unwrap().stiffness_v_per_mm = 400.0),
        ),
        (
            "friction.lugre.stiffness_v_per_mm",
            with_x(|axis| axis.friction.lugre.as_mut().unwrap().stiffness_v_per_mm = 400.0),
        ),
    ] {
        let error = refusal(&stiff);
        assert_eq!(error.field, expected);
        assert_eq!(error.reason, Reason::TooStiffForRate { most });
    }
}

#[test]
fn a_kind_whose_model_is_missing_is_refused_by_name() {
    for (kind, field) in [
        (FeedforwardKind::Dahl, "friction.dahl"),
        (FeedforwardKind::Lugre, "friction.lugre"),
    ] {
        let bare = |axis: &mut AxisSettings| {
            axis.friction.dahl = None;
            axis.friction.lugre = None;
        };
        assert_eq!(with_x(bare).validate(ROOM), Ok(()));
        let (refused, reason, text) = reason(|axis| {
            bare(axis);
            axis.feedforward.kind = kind;
        });
        assert_eq!((refused, reason), (field, Reason::Missing));
        let path = field.replace('.', "/");
        assert!(text.starts_with(&format!("x/{path} is missing")), "{text}");
    }
}

/// Files from before there were these models.
#[test]
fn settings_without_the_single_state_models_still_load() {
    let mut tree = serde_json::to_value(StageSettings::simulated()).expect("plain data");
    for axis in tree["axes"].as_array_mut().expect("axes") {
        let friction = axis["friction"].as_object_mut().expect("fields");
        for field in ["dahl", "lugre", "smoothed_gms"] {
            assert!(friction.remove(field).is_some(), "{field}");
        }
    }
    let loaded: StageSettings = serde_json::from_value(tree).expect("loads");
    assert_eq!(loaded.validate(ROOM), Ok(()));
    assert_eq!(loaded.axes[0].friction.dahl, None);
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
    // As are 256 counts per tick squared.
    let abrupt = with_x(|axis| {
        axis.encoder.resolution_mm = 1.05e-6;
        axis.limits.max_velocity_mm_s = 1.0;
        axis.limits.max_acceleration_mm_s2 = 27_000.0;
    });
    check_message(
        &refusal(&abrupt),
        AxisName::X,
        "limits.max_acceleration_mm_s2",
    );
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

#[test]
fn a_law_without_its_parameters_is_refused_by_name() {
    for (law, field) in [
        (LawKind::NPid, "feedback.nonlinear"),
        (LawKind::Scheduled, "feedback.schedule"),
        (LawKind::Cascade, "feedback.cascade"),
        (LawKind::SlidingMode, "feedback.sliding_mode"),
        (LawKind::Nctf, "feedback.nctf"),
    ] {
        let bare = with_x(|axis| {
            let feedback = &mut axis.feedback;
            feedback.law = law;
            feedback.nonlinear = None;
            feedback.schedule = None;
            feedback.cascade = None;
            feedback.sliding_mode = None;
            feedback.nctf = None;
        });
        let error = refusal(&bare);
        assert_eq!((error.field, error.reason), (field, Reason::Missing));
        let text = format!(
            "x/{} is missing, which the chosen law or kind of feedforward needs: `quadrant commission` fills it in",
            field.replace('.', "/")
        );
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn an_unstable_law_is_refused_when_a_plant_is_given() {
    for law in LawKind::ALL {
        let wild = |axis: &mut AxisSettings| {
            let feedback = &mut axis.feedback;
            feedback.law = law;
            feedback.nonlinear.as_mut().expect("by default").rate_per_mm = 0.0;
            feedback.pid.kp_v_per_mm *= 4.0;
            feedback.pid.kd_v_s_per_mm *= 4.0;
            feedback
                .sliding_mode
                .as_mut()
                .expect("by default")
                .boundary_mm_s /= 4.0;
            let cascade = feedback.cascade.as_mut().expect("by default");
            cascade.velocity_gain_v_s_per_mm *= 4.0;
            feedback.nctf.as_mut().expect("by default").gain_v_s_per_mm *= 4.0;
        };
        let (_, reason, text) = reason(wild);
        let refused = matches!(reason, Reason::Unstable | Reason::BeyondPopov { .. });
        assert!(refused, "{law:?}: {text}");
        let unknown = with_x(|axis| {
            wild(axis);
            axis.plant = None;
        });
        assert_eq!(unknown.validate(ROOM), Ok(()), "{law:?}");
    }
}

#[test]
fn a_gain_that_is_too_high_is_blamed_and_not_the_nonlinear_gain_upon_it() {
    for law in [LawKind::Pid, LawKind::NPid] {
        let (field, reason_given, text) = reason(|axis| {
            axis.feedback.law = law;
            axis.feedback.pid.kp_v_per_mm *= 1000.0;
        });
        assert_eq!(field, "feedback.pid.kp_v_per_mm", "{text}");
        assert_eq!(reason_given, Reason::Unstable);
    }
}

#[test]
fn a_plant_may_be_known_before_the_law_has_gains_but_no_axis_is_commissioned_without_any() {
    let plant = StageSettings::simulated().axes[0].plant;
    let mut settings = StageSettings::default();
    settings.axes[0].plant = plant;
    assert_eq!(settings.validate(ROOM), Ok(()));
    let (field, reason_given, text) = reason(|axis| {
        *axis = quadrant_settings::AxisSettings {
            commissioned: true,
            plant,
            ..StageSettings::default().axes[0].clone()
        };
    });
    assert_eq!(field, "feedback.pid.kp_v_per_mm", "{text}");
    assert_eq!(reason_given, Reason::NoGain);
    assert!(text.contains("`quadrant design pid`"), "{text}");
}

#[test]
fn points_that_do_not_rise_are_refused() {
    let (field, reason_given, _) = reason(|axis| {
        let schedule = axis.feedback.schedule.as_mut().expect("by default");
        schedule[1].speed_mm_s = 0.0;
    });
    assert_eq!(field, "feedback.schedule.speed_mm_s");
    assert_eq!(reason_given, Reason::NotRising);
    for (error_mm, velocity_mm_s, field) in [
        (1.0, 300.0, "feedback.nctf.characteristic.error_mm"),
        (2.0, 200.0, "feedback.nctf.characteristic.velocity_mm_s"),
    ] {
        let (refused, reason, text) = reason(|axis| {
            let nctf = axis.feedback.nctf.as_mut().expect("by default");
            let point = CharacteristicPoint {
                error_mm,
                velocity_mm_s,
            };
            nctf.characteristic.push(point).expect("room");
        });
        assert_eq!((refused, reason), (field, Reason::NotRising), "{text}");
    }
}
