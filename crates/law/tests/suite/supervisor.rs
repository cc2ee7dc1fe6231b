//! The commands that the supervising task lets through, and the events that it reports.

use quadrant_law::admission::Refusal;
use quadrant_law::admission::StageView;
use quadrant_law::axes::AxisName;
use quadrant_law::axes::PerAxis;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::{EnableInterlock, EnabledBy, Fault, FaultCode, SafetyState};
use quadrant_law::supervisor::{Decision, Event, Supervisor};

const FAULT: Fault = Fault {
    code: FaultCode::DeadlineMissed,
    axis: None,
    tick: 7,
};

const DISABLED: StageView = StageView {
    safety: SafetyState::Disabled,
    running: false,
    interlock: None,
    moving: None,
    awaiting_homing: PerAxis::splat(false),
    held: None,
    modes: PerAxis::splat(MotionMode::Hold),
    homed: PerAxis::splat(false),
    stream_ready: false,
    injection_ready: false,
    injecting: false,
    commissioned: true,
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
const ENABLED: StageView = StageView {
    safety: SafetyState::Enabled,
    ..DISABLED
};
const MOVING: StageView = StageView {
    safety: SafetyState::Enabled,
    running: true,
    ..DISABLED
};
const FAULTED: StageView = StageView {
    safety: SafetyState::Faulted(FAULT),
    ..DISABLED
};
const STOPPING: StageView = StageView {
    safety: SafetyState::Stopping(FAULT),
    running: true,
    ..DISABLED
};

/// The decision on `view` of a supervisor that has seen `before`.
fn decide(before: StageView, view: StageView, request: Option<Command>) -> Decision {
    let mut supervisor = Supervisor::default();
    supervisor.step(before, None);
    supervisor.step(view, request)
}

fn events(before: StageView, view: StageView) -> Vec<Event> {
    let decision = decide(before, view, None);
    assert_eq!(decision.command, None);
    decision.events.into_iter().flatten().collect()
}

#[test]
fn requests_pass_where_they_make_sense() {
    for (view, command) in [
        (DISABLED, Command::Enable),
        (ENABLED, Command::Disable),
        (MOVING, Command::Disable),
        (STOPPING, Command::Disable),
        (FAULTED, Command::ResetFault),
        (ENABLED, Command::Run),
    ] {
        let decision = decide(view, view, Some(command));
        assert_eq!(decision.command, Some(command), "{view:?}");
        assert_eq!(decision.events, [None; 5]);
    }
}

#[test]
fn requests_are_refused_with_a_reason_where_they_do_not() {
    for (view, command, reason) in [
        (FAULTED, Command::Enable, Refusal::FaultLatched),
        (FAULTED, Command::Run, Refusal::FaultLatched),
        (DISABLED, Command::Run, Refusal::NotEnabled),
        (MOVING, Command::Run, Refusal::AlreadyRunning),
        (DISABLED, Command::ResetFault, Refusal::NoFault),
        (ENABLED, Command::ResetFault, Refusal::NoFault),
        (STOPPING, Command::Enable, Refusal::Stopping),
        (STOPPING, Command::Run, Refusal::Stopping),
        (STOPPING, Command::ResetFault, Refusal::Stopping),
        (StageView::default(), Command::Enable, Refusal::Starting),
    ] {
        let decision = decide(view, view, Some(command));
        assert_eq!(decision.command, None, "{view:?} {command:?}");
        let refused = Event::Refused(command, reason);
        assert_eq!(decision.events, [None, None, None, None, Some(refused)]);
        assert!(!reason.as_str().is_empty());
    }
}

#[test]
fn changes_of_state_are_reported_once() {
    assert_eq!(events(DISABLED, ENABLED), [Event::Enabled]);
    assert_eq!(events(ENABLED, DISABLED), [Event::Disabled]);
    assert_eq!(events(FAULTED, DISABLED), [Event::Disabled]);
    assert_eq!(events(ENABLED, FAULTED), [Event::Faulted(FAULT)]);
    assert_eq!(events(MOVING, STOPPING), [Event::Stopping(FAULT)]);
    assert_eq!(events(STOPPING, FAULTED), [Event::Faulted(FAULT)]);
    assert_eq!(events(StageView::default(), DISABLED), []);
    for view in [DISABLED, ENABLED, MOVING, FAULTED, STOPPING] {
        assert_eq!(events(view, view), []);
    }
}

#[test]
fn motions_are_reported_when_they_begin_and_end() {
    assert_eq!(events(ENABLED, MOVING), [Event::MotionStarted]);
    assert_eq!(events(MOVING, ENABLED), [Event::MotionFinished]);
    // A motion that a fault cut short did not come to its end.
    assert_eq!(events(MOVING, FAULTED), [Event::Faulted(FAULT)]);
    assert_eq!(events(MOVING, DISABLED), [Event::Disabled]);
}

#[test]
fn another_fault_is_another_event() {
    let later = StageView {
        safety: SafetyState::Faulted(Fault { tick: 8, ..FAULT }),
        ..FAULTED
    };
    assert_eq!(events(FAULTED, later).len(), 1);
}

#[test]
fn enabling_with_a_bad_input_is_refused_and_names_it() {
    for (code, axis, words) in [
        (
            FaultCode::EmergencyStop,
            None,
            "the emergency stop is pressed; release it",
        ),
        (
            FaultCode::AmplifierFault,
            Some(AxisName::Y),
            "y: the amplifier reports a fault",
        ),
        (
            FaultCode::OutputMismatch,
            Some(AxisName::Z),
            "z: the converter holds another word",
        ),
        (
            FaultCode::StaleSample,
            Some(AxisName::X),
            "x: the encoder's reading is stale",
        ),
        (
            FaultCode::EncoderInvalid,
            Some(AxisName::Z),
            "z: the encoder's readings are not valid",
        ),
    ] {
        let interlock = EnableInterlock { code, axis };
        for safety in [SafetyState::Start, SafetyState::Disabled] {
            let view = StageView {
                safety,
                interlock: Some(interlock),
                ..DISABLED
            };
            let decision = decide(view, view, Some(Command::Enable));
            assert_eq!(decision.command, None);
            let Some(Event::Refused(Command::Enable, refusal)) = decision.events[4] else {
                panic!("{decision:?}");
            };
            assert_eq!(refusal, Refusal::BadInput(interlock));
            assert!(refusal.to_string().starts_with(words), "{refusal}");
        }
        // A latched fault is what a person is to learn first.
        let faulted = StageView {
            interlock: Some(interlock),
            ..FAULTED
        };
        let decision = decide(faulted, faulted, Some(Command::Enable));
        let refused = Event::Refused(Command::Enable, Refusal::FaultLatched);
        assert_eq!(decision.events[4], Some(refused));
    }
}

#[test]
fn a_fault_that_only_held_the_axes_is_reported_once() {
    let held = StageView {
        held: Some(FAULT),
        ..MOVING
    };
    assert_eq!(events(MOVING, held), [Event::Held(FAULT)]);
    assert_eq!(events(held, held), []);
    assert_eq!(events(held, MOVING), []);
}
