//! The supervising task's decisions: which requests reach the control law, and what a person is told.
//!
//! Runs every [`PERIOD_TICKS`] control ticks, below the control interrupt. Pure, so that the firmware and the host's
//! run of the same job decide alike.

use crate::safety::{Command, Fault, SafetyState};

/// Control ticks between two runs of the supervisor: 1 kHz at a control rate of 10 kHz.
pub const PERIOD_TICKS: u32 = 10;

/// What the supervisor sees of the stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageView {
    /// Who drives the outputs.
    pub safety: SafetyState,
    /// Whether a motion is under way.
    pub running: bool,
}

/// Why a request did not reach the control law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A fault is latched; reset it first.
    FaultLatched,
    /// The outputs are off; enable them first.
    NotEnabled,
    /// A motion is under way.
    AlreadyRunning,
    /// There is no fault to reset.
    NoFault,
}

impl Refusal {
    /// The refusal in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::FaultLatched => "a fault is latched; reset it first",
            Self::NotEnabled => "the outputs are off; enable them first",
            Self::AlreadyRunning => "a motion is under way",
            Self::NoFault => "there is no fault to reset",
        }
    }
}

/// Something a person should read in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The outputs were switched on.
    Enabled,
    /// The outputs were switched off.
    Disabled,
    /// A fault switched the outputs off.
    Faulted(Fault),
    /// The plan's motions began.
    MotionStarted,
    /// The plan's motions came to their end.
    MotionFinished,
    /// A request was refused.
    Refused(Command, Refusal),
}

/// The supervisor's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervisor {
    seen: StageView,
}

/// What one run of the supervisor decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decision {
    /// For the control law's next tick.
    pub command: Option<Command>,
    /// For the log: a change of state, a change of motion, a refusal.
    pub events: [Option<Event>; 3],
}

impl Supervisor {
    /// Looks at the stage and at a request, if there is one.
    pub fn step(&mut self, view: StageView, request: Option<Command>) -> Decision {
        let seen = core::mem::replace(&mut self.seen, view);
        let state = (seen.safety != view.safety).then_some(match view.safety {
            SafetyState::Disabled => Event::Disabled,
            SafetyState::Enabled => Event::Enabled,
            SafetyState::Faulted(fault) => Event::Faulted(fault),
        });
        let motion = match (seen.running, view.running) {
            (false, true) => Some(Event::MotionStarted),
            (true, false) if view.safety.is_enabled() => Some(Event::MotionFinished),
            _ => None,
        };
        let refusal = request.and_then(|command| {
            refusal(view, command).map(|reason| Event::Refused(command, reason))
        });
        Decision {
            command: if refusal.is_none() { request } else { None },
            events: [state, motion, refusal],
        }
    }
}

fn refusal(view: StageView, command: Command) -> Option<Refusal> {
    let faulted = matches!(view.safety, SafetyState::Faulted(_));
    match command {
        Command::Enable | Command::Run if faulted => Some(Refusal::FaultLatched),
        Command::Run if !view.safety.is_enabled() => Some(Refusal::NotEnabled),
        Command::Run if view.running => Some(Refusal::AlreadyRunning),
        Command::ResetFault if !faulted => Some(Refusal::NoFault),
        _ => None,
    }
}
