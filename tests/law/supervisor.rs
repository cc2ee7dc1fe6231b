//! What the supervising task lets through, and what it tells.

use quadrant::safety::{Command, Fault, FaultCode, SafetyState};
use quadrant::supervisor::{Decision, Event, Refusal, StageView, Supervisor};

const FAULT: Fault = Fault {
    code: FaultCode::DeadlineMissed,
    axis: None,
    tick: 7,
};

const DISABLED: StageView = StageView {
    safety: SafetyState::Disabled,
    running: false,
};
const ENABLED: StageView = StageView {
    safety: SafetyState::Enabled,
    running: false,
};
const MOVING: StageView = StageView {
    safety: SafetyState::Enabled,
    running: true,
};
const FAULTED: StageView = StageView {
    safety: SafetyState::Faulted(FAULT),
    running: false,
};

/// What a supervisor that has seen `before` decides on `view`.
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
        (FAULTED, Command::ResetFault),
        (ENABLED, Command::Run),
    ] {
        let decision = decide(view, view, Some(command));
        assert_eq!(decision.command, Some(command), "{view:?}");
        assert_eq!(decision.events, [None; 3]);
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
    ] {
        let decision = decide(view, view, Some(command));
        assert_eq!(decision.command, None, "{view:?} {command:?}");
        let told = Event::Refused(command, reason);
        assert_eq!(decision.events, [None, None, Some(told)]);
        assert!(!reason.as_str().is_empty());
    }
}

#[test]
fn changes_of_state_are_told_once() {
    assert_eq!(events(DISABLED, ENABLED), [Event::Enabled]);
    assert_eq!(events(ENABLED, DISABLED), [Event::Disabled]);
    assert_eq!(events(FAULTED, DISABLED), [Event::Disabled]);
    assert_eq!(events(ENABLED, FAULTED), [Event::Faulted(FAULT)]);
    for view in [DISABLED, ENABLED, MOVING, FAULTED] {
        assert_eq!(events(view, view), []);
    }
}

#[test]
fn motions_are_told_when_they_begin_and_end() {
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
