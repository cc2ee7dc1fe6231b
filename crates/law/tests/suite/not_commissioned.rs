//! A board with nothing in its flash has no law: its outputs stay off, and a person learns what to do.

use quadrant_law::admission::Refusal;
use quadrant_law::admission::StageView;
use quadrant_law::admission::refusal;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::{MotionSettings, Segment};
use quadrant_law::safety::{EnabledBy, SafetyState};
use quadrant_law::supervisor::{Event, Supervisor};
use quadrant_settings::{AxisSettings, InjectionSettings, PlanSettings, StageSettings};

use quadrant_test_support::{Rig, sine_on_x};

use crate::injection::{Bench, request};

const READY: StageView = StageView {
    safety: SafetyState::Disabled,
    running: false,
    interlock: None,
    moving: None,
    awaiting_homing: PerAxis::splat(false),
    held: None,
    modes: PerAxis::splat(quadrant_law::motion::MotionMode::Hold),
    homed: PerAxis::splat(false),
    stream_ready: false,
    injection_ready: false,
    injecting: false,
    commissioned: false,
    uncommissioned: None,
    inert: PerAxis::splat(false),
    inert_planned: None,
    inert_streamed: None,
    inert_injected: None,
    brake_moves: false,
    enabled_by: EnabledBy::Any,
    locked: false,
    settings_invalid: false,
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
fn the_law_itself_enables_nothing_on_the_default_settings() {
    let mut rig = Rig::<f32>::new(&StageSettings::default(), &Default::default());
    rig.start();
    for count in 0..500 {
        rig.inputs.readings[0].count = count;
        let outputs = rig.tick();
        assert_eq!(outputs.codes.map(|code| code.0), [0; 3]);
        assert!(!outputs.enabled);
    }
}

#[test]
fn an_axis_without_a_law_does_not_move_beside_one_that_is_commissioned() {
    let view = StageView {
        safety: SafetyState::Enabled,
        commissioned: true,
        inert: PerAxis::from_fn(|axis| axis == AxisName::Y),
        ..READY
    };
    let motions = |axis| [Command::Home(axis), Command::StartMove(axis)];
    for command in motions(AxisName::Y) {
        assert_eq!(refusal(view, command), Some(Refusal::NoLaw(AxisName::Y)));
    }
    for command in motions(AxisName::X) {
        assert_eq!(refusal(view, command), None);
    }
    let text = Refusal::NoLaw(AxisName::Y).to_string();
    assert!(
        text.starts_with("y: ") && text.contains("commission it"),
        "{text}"
    );
}

/// x is commissioned; y has no law.
fn y_without_a_law() -> StageSettings {
    let mut settings = StageSettings::simulated();
    settings.axes[1] = AxisSettings::default();
    settings
}

/// A plan that moves the axes of which `moves` is true.
fn moving(moves: [bool; 3]) -> PlanSettings {
    let sine = sine_on_x(1.0, 5.0).motions[0];
    PlanSettings {
        motions: moves.map(|moves| if moves { sine } else { MotionSettings::Hold }),
    }
}

/// An enabled stage.
fn enabled(settings: &StageSettings, plan: &PlanSettings) -> Rig<f32> {
    let mut rig = Rig::new(settings, plan);
    rig.tick();
    assert!(rig.command(Command::Enable).enabled);
    rig
}

#[test]
fn a_plan_that_moves_an_axis_without_a_law_starts_nothing() {
    for (moves, starts) in [
        ([true, true, false], false),
        ([false, true, false], false),
        ([true, false, true], true),
    ] {
        let mut rig = enabled(&y_without_a_law(), &moving(moves));
        let view = rig.stage.as_ref().view(&rig.plan, &rig.state);
        let refused = refusal(view, Command::Run);
        assert_eq!(
            refused,
            (!starts).then_some(Refusal::NoLaw(AxisName::Y)),
            "{moves:?}"
        );
        rig.command(Command::Run);
        assert_eq!(rig.state.is_running(), starts, "{moves:?}");
    }
}

#[test]
fn a_plan_that_began_before_its_axis_lost_its_law_does_not_begin_again() {
    let plan = moving([true, true, false]);
    let mut rig = enabled(&StageSettings::simulated(), &plan);
    rig.exchange(&y_without_a_law());
    rig.command(Command::Run);
    assert!(!rig.state.is_running());
}

#[test]
fn a_stream_whose_first_segment_moves_an_axis_without_a_law_starts_nothing() {
    let still = Segment {
        ticks: 100,
        first: true,
        ..Segment::default()
    };
    let moving = Segment {
        differences: [1 << 64, 0, 0, 0, 0],
        ..still
    };
    for (of_y, starts) in [(moving, false), (still, true)] {
        let mut rig = enabled(&y_without_a_law(), &PlanSettings::default());
        for (axis, segment) in AxisName::ALL.into_iter().zip([moving, of_y, still]) {
            rig.state.offer_segment(axis, &segment);
        }
        rig.command(Command::StartStream);
        assert_eq!(rig.state.is_running(), starts, "{of_y:?}");
    }
}

#[test]
fn an_injection_starts_no_plan_that_moves_an_axis_without_a_law() {
    for (with_plan, starts) in [(true, false), (false, true)] {
        let plan = moving([true, true, false]);
        let mut bench = Bench::<f32>::new(&y_without_a_law(), &plan);
        let request = InjectionSettings {
            with_plan,
            ..request(false)
        };
        bench.begin(&request, &[0; 20]);
        bench.tick();
        assert_eq!(bench.rig.state.is_running(), starts, "{with_plan}");
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
    let refused = Event::Refused(Command::Enable, Refusal::NotCommissioned);
    assert!(decision.events.contains(&Some(refused)));
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
fn a_changed_number_is_no_commissioning() {
    for axis in 0..3 {
        let mut settings = StageSettings::default();
        settings.axes[axis].limits.following_error_mm = 10.0;
        assert!(!settings.is_commissioned());
        settings.axes[axis].feedback.pid.kp_v_per_mm = 1.0;
        assert!(!settings.is_commissioned());
        settings.axes[axis].commissioned = true;
        assert!(settings.is_commissioned());
    }
    assert!(StageSettings::simulated().is_commissioned());
}

/// Each way in which a law of an axis that nobody has commissioned could drive it.
#[test]
fn one_axis_with_a_law_that_was_not_commissioned_keeps_the_outputs_off() {
    let drive: [fn(&mut AxisSettings); 6] = [
        |axis| axis.feedback.pid.kp_v_per_mm = 1.0,
        |axis| axis.feedback.pid.ki_v_per_mm_s = 1.0,
        |axis| axis.feedback.pid.kd_v_s_per_mm = 0.01,
        |axis| axis.feedforward.kind = FeedforwardKind::Static,
        |axis| axis.feedforward.gains.inertia_v_s2_per_mm = 1e-4,
        |axis| axis.amplifier.offset_v = 0.1,
    ];
    for drive in drive {
        let mut settings = StageSettings::default();
        settings.axes[0].commissioned = true;
        drive(&mut settings.axes[0]);
        let mut rig = Rig::<f32>::new(&settings, &Default::default());
        rig.tick();
        assert!(rig.command(Command::Enable).enabled);
        drive(&mut settings.axes[2]);
        let mut rig = Rig::<f32>::new(&settings, &Default::default());
        rig.tick();
        let view = rig.stage.as_ref().view(&rig.plan, &rig.state);
        let named = Refusal::LawNotCommissioned(AxisName::Z);
        assert_eq!(refusal(view, Command::Enable), Some(named));
        assert_eq!(settings.uncommissioned(), Some(AxisName::Z));
        assert!(!rig.command(Command::Enable).enabled);
        assert!(!rig.tick().enabled);
    }
}
