//! Settings that are edited leaf by leaf and take effect as a whole.

use quadrant_law::axes::AxisName;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::stage::Stage;
use quadrant_settings::StageSettings;
use quadrant_settings::draft::{ApplyError, Draft};
use quadrant_settings::leaves::{Exchange, all};

fn draft_of(settings: StageSettings) -> Draft<'static> {
    let room = || Box::leak(Box::new(StageSettings::simulated()));
    let in_force = room();
    *in_force = settings;
    Draft::new(in_force, room())
}

fn draft() -> Draft<'static> {
    draft_of(StageSettings::simulated())
}

fn set(draft: &mut Draft, path: &str, json: &str) {
    draft.set_json(path, json.as_bytes()).expect("a setting");
}

#[test]
fn only_the_axes_that_were_written_are_rebuilt() {
    let mut draft = draft();
    assert_eq!(draft.apply(8), Ok([false; 3]));
    set(&mut draft, "/axes/y/feedback/pid/kp_v_per_mm", "1.2");
    assert!(draft.is_edited());
    assert_eq!(draft.apply(8), Ok([false, true, false]));
    assert!(!draft.is_edited());
    assert_eq!(draft.apply(8), Ok([false; 3]));
    set(&mut draft, "/axes/x/plant", "null");
    set(&mut draft, "/axes/z/feedforward/kind", "\"static\"");
    assert_eq!(draft.apply(8), Ok([true, false, true]));
}

/// The law and its parameters arrive one after the other.
#[test]
fn what_is_contradictory_only_for_a_while_is_accepted() {
    let mut draft = draft();
    set(&mut draft, "/axes/x/feedback/nctf", "null");
    set(&mut draft, "/axes/x/feedback/law", "\"nctf\"");
    let Err(ApplyError::Refused(error)) = draft.apply(8) else {
        panic!("a law without its parameters");
    };
    assert_eq!(error.field, "feedback.nctf");
    assert!(draft.is_edited(), "the draft is still there to be mended");
    set(&mut draft, "/axes/x/feedback/nctf", "\"present\"");
    let Err(ApplyError::Refused(error)) = draft.apply(8) else {
        panic!("a trajectory that nobody has given");
    };
    assert_eq!(error.field, "feedback.nctf.characteristic.error_mm");
    let points = r#"[{"error_mm":1.2,"velocity_mm_s":250.0}]"#;
    set(&mut draft, "/axes/x/feedback/nctf/characteristic", points);
    set(
        &mut draft,
        "/axes/x/feedback/nctf/gain_v_s_per_mm",
        "0.0055",
    );
    assert_eq!(draft.apply(8), Ok([true, false, false]));
}

#[test]
fn a_refused_value_refuses_the_whole() {
    let mut draft = draft();
    set(&mut draft, "/axes/x/feedback/pid/kp_v_per_mm", "1.0");
    set(&mut draft, "/axes/z/amplifier/offset_v", "5");
    let message = draft.apply(8).expect_err("beyond its range").to_string();
    assert_eq!(message, "z/amplifier/offset_v = 5 is outside -1 to 1");
    set(&mut draft, "/axes/z/amplifier/offset_v", "0.5");
    assert_eq!(draft.apply(8), Ok([true, false, true]));
}

#[test]
fn rate_and_encoders_wait_for_a_restart() {
    let mut draft = draft();
    set(&mut draft, "/rate_hz", "11000");
    assert_eq!(draft.apply(8), Err(ApplyError::RateNeedsRestart));
    set(&mut draft, "/rate_hz", "10000");
    set(&mut draft, "/axes/y/encoder/resolution_mm", "0.001");
    assert_eq!(
        draft.apply(8),
        Err(ApplyError::EncoderNeedsRestart(AxisName::Y))
    );
    draft.settings().validate(8).expect("can be stored");
    // After the restart.
    let mut draft = draft_of(draft.settings().clone());
    assert_eq!(draft.apply(8), Ok([false; 3]));
}

#[test]
fn a_longer_preview_concerns_every_axis() {
    let mut draft = draft();
    set(&mut draft, "/axes/x/feedforward/preview_s", "0.0011");
    assert_eq!(
        draft.apply(8),
        Ok([true, false, false]),
        "z looks ahead further"
    );
    set(&mut draft, "/axes/z/feedforward/preview_s", "0.0021");
    assert_eq!(draft.apply(8), Ok([true; 3]));
}

#[test]
fn the_axes_built_one_by_one_are_those_of_the_stage() {
    let mut draft = draft();
    set(&mut draft, "/axes/y/feedforward/preview_s", "0.0019");
    let stage: Stage<f32, 8> = draft.settings().build().expect("valid");
    for axis in AxisName::ALL {
        let alone = draft.settings().build_axis::<f32, 8>(axis);
        assert_eq!(alone, *stage.axis(axis));
    }
}

#[test]
fn a_set_that_is_loaded_over_a_draft_concerns_every_axis() {
    let mut draft = draft();
    draft.settings_mut().copy_from(&StageSettings::simulated());
    assert_eq!(draft.apply(8), Ok([true; 3]));
}

#[test]
fn what_is_in_force_stays_until_the_draft_takes_effect_and_can_be_gone_back_to() {
    let mut draft = draft();
    set(&mut draft, "/axes/y/feedback/pid/kp_v_per_mm", "1.2");
    assert_eq!(*draft.in_force(), StageSettings::simulated());
    draft.revert();
    assert!(!draft.is_edited());
    assert_eq!(*draft.settings(), StageSettings::simulated());
    set(&mut draft, "/axes/y/feedback/pid/kp_v_per_mm", "1.2");
    draft.apply(8).expect("valid");
    assert_eq!(draft.in_force().axes[1].feedback.pid.kp_v_per_mm, 1.2);
    draft.revert();
    assert_eq!(draft.settings(), draft.in_force());
}

#[test]
fn settings_made_in_place_are_the_default_ones_and_copies_are_the_same() {
    let mut settings = StageSettings {
        rate_hz: 5e3,
        ..StageSettings::simulated()
    };
    settings.streaming.link_lost = quadrant_settings::LossReaction::Hold;
    settings.axes[2].homing = None;
    settings.axes[0].feedback.pid.kp_v_per_mm = 7.0;
    let mut copy = StageSettings::simulated();
    copy.copy_from(&settings);
    assert_eq!(copy, settings);
    copy.set_default();
    assert_eq!(copy, StageSettings::default());
}

/// The server builds into an axis that was another's.
#[test]
fn an_axis_built_in_the_place_of_another_is_the_same() {
    let settings = StageSettings::simulated();
    for kind in FeedforwardKind::ALL {
        let mut settings = settings.clone();
        settings.axes[0].feedforward.kind = kind;
        let mut place = settings.build_axis::<f32, 8>(AxisName::Z);
        settings.build_axis_into(AxisName::X, &mut place);
        assert_eq!(place, settings.build_axis(AxisName::X), "{kind:?}");
    }
}

#[test]
fn a_setting_on_which_safety_depends_is_named() {
    let text = |change: &dyn Fn(&mut Draft)| {
        let mut draft = draft();
        change(&mut draft);
        draft.safety_change().map(|leaf| leaf.to_string())
    };
    assert_eq!(text(&|_| {}), None);
    for (path, json, said) in [
        ("/axes/x/amplifier/reversed", "true", "x/amplifier/reversed"),
        (
            "/axes/y/amplifier/output_limit_v",
            "9.0",
            "y/amplifier/output_limit_v",
        ),
        (
            "/axes/z/limits/braking_mm_s2",
            "5000",
            "z/limits/braking_mm_s2",
        ),
        (
            "/axes/z/limits/travel_mm",
            "null",
            "z/limits/travel_mm/negative",
        ),
        ("/axes/y/homing/switch", "\"limit\"", "y/homing/switch"),
        ("/axes/x/plant", "null", "x/plant/gain_mm_per_v_s2"),
        ("/streaming/link_lost", "\"hold\"", "streaming/link_lost"),
    ] {
        let found = text(&|draft| set(draft, path, json)).expect(path);
        assert!(found.starts_with(said), "{found}");
    }
    // A law may be tuned while it acts.
    for (path, json) in [
        ("/axes/x/feedback/pid/kp_v_per_mm", "1.0"),
        ("/axes/x/feedback/law", "\"pid\""),
        ("/axes/y/friction/gms/attraction_v_s", "4.0"),
        ("/axes/z/feedforward/kind", "\"static\""),
    ] {
        assert_eq!(text(&|draft| set(draft, path, json)), None, "{path}");
    }
}

/// A row that is added to the table must not forget its column.
#[test]
fn every_leaf_of_amplifier_limits_homing_plant_and_commissioning_needs_the_outputs_off() {
    for leaf in all() {
        let group = leaf.field.split('.').next().expect("a name");
        let expected = match group {
            "rate_hz" | "encoder" => Exchange::Restart,
            "operation" | "brake" | "streaming" | "amplifier" | "limits" | "homing" | "pulses"
            | "plant" | "commissioned" => Exchange::Disabled,
            // The comparison of encoder and plant allows for it.
            "feedforward" if leaf.field == "feedforward.cancelling.limit_v" => Exchange::Disabled,
            "feedback" | "friction" | "feedforward" => Exchange::Driven,
            other => panic!("{other} is no group"),
        };
        assert_eq!(leaf.exchange, expected, "{}", leaf.field);
    }
}
