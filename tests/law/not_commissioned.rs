//! A board with nothing in its flash has no law: its outputs stay off, and a person learns what to do.

use quadrant::admission::Refusal;
use quadrant::admission::StageView;
use quadrant::admission::refusal;
use quadrant::app::supervisor::{Event, Supervisor};
use quadrant::axes::PerAxis;
use quadrant::command::Command;
use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::safety::SafetyState;
use quadrant::settings::StageSettings;

use crate::common::Rig;

const READY: StageView = StageView {
    safety: SafetyState::Disabled,
    running: false,
    interlock: None,
    held: None,
    modes: PerAxis::splat(quadrant::motion::MotionMode::Hold),
    homed: PerAxis::splat(false),
    stream_ready: false,
    injection_ready: false,
    injecting: false,
    commissioned: false,
};

#[test]
fn the_default_settings_hold_no_law_and_are_valid() {
    let settings = StageSettings::default();
    assert_eq!(settings.validate(1), Ok(()));
    assert!(!settings.is_commissioned());
    for axis in &settings.axes {
        let pid = axis.feedback.pid;
        assert_eq!(axis.feedback.law, LawKind::Pid);
        assert_eq!(
            (pid.kp_v_per_mm, pid.ki_v_per_mm_s, pid.kd_v_s_per_mm),
            (0.0, 0.0, 0.0)
        );
        assert_eq!(axis.feedforward.kind, FeedforwardKind::None);
        assert_eq!((axis.plant, axis.homing), (None, None));
    }
}

#[test]
fn the_default_settings_move_nothing_even_if_the_law_is_enabled() {
    let mut rig = Rig::<f32>::new(&StageSettings::default(), &Default::default());
    rig.start();
    for count in 0..500 {
        rig.inputs.readings[0].count = count;
        let outputs = rig.tick();
        assert_eq!(outputs.codes.map(|code| code.0), [0; 3]);
    }
}

#[test]
fn enabling_is_refused_with_the_reason_and_the_remedy() {
    let refused = refusal(READY, Command::Enable);
    assert_eq!(refused, Some(Refusal::NotCommissioned));
    let text = Refusal::NotCommissioned.to_string();
    assert!(
        text.starts_with("not commissioned: ") && text.contains("`quadrant commission`"),
        "{text}"
    );
    let mut supervisor = Supervisor::default();
    supervisor.step(READY, None);
    let decision = supervisor.step(READY, Some(Command::Enable));
    assert_eq!(decision.command, None);
    let told = Event::Refused(Command::Enable, Refusal::NotCommissioned);
    assert!(decision.events.contains(&Some(told)));
}

#[test]
fn nothing_but_enabling_is_refused_for_it() {
    for command in [Command::Disable, Command::Stop] {
        assert_eq!(refusal(READY, command), None);
    }
    let commissioned = StageView {
        commissioned: true,
        ..READY
    };
    assert_eq!(refusal(commissioned, Command::Enable), None);
}

#[test]
fn one_axis_that_somebody_has_set_up_is_enough() {
    for axis in 0..3 {
        let mut settings = StageSettings::default();
        settings.axes[axis].feedback.pid.kp_v_per_mm = 1.0;
        assert!(settings.is_commissioned());
        // For a measurement in open loop: no gain, but more room for the tracking error.
        let mut settings = StageSettings::default();
        settings.axes[axis].limits.following_error_mm = 10.0;
        assert!(settings.is_commissioned());
    }
    assert!(StageSettings::simulated().is_commissioned());
}
