//! The supervising task's decisions: passing or refusing requests, and events for the log.
//!
//! Runs every [`PERIOD_TICKS`] control ticks, below the control interrupt. Pure, so that the firmware and the host's
//! run of the same job decide alike.

use crate::admission::{Refusal, StageView, refusal_from};
use crate::axes::AxisName;
use crate::command::Command;
use crate::safety::oscillation::OscillationKind;
use crate::safety::{Fault, SafetyState, Station};

/// Control ticks between two runs of the supervisor: 1 kHz at a control rate of 10 kHz.
pub const PERIOD_TICKS: u32 = 10;

/// Something a person should read in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The outputs were switched on.
    Enabled,
    /// The outputs were switched off.
    Disabled,
    /// A fault was found, and the axes brake under control.
    Stopping(Fault),
    /// A fault switched the outputs off.
    Faulted(Fault),
    /// A fault was found, and the axes brake and hold.
    Held(Fault),
    /// The plan's motions began.
    MotionStarted,
    /// The plan's motions came to their end.
    MotionFinished,
    /// An axis that stood was moved though the outputs are off.
    MovedWhileOff(AxisName),
    /// The friction of an axis has settled away from what was commissioned.
    FrictionChanged(FrictionChange),
    /// An axis oscillates, or did so until what is added to it was taken away.
    Oscillated(Oscillated),
    /// A request was refused.
    Refused(Command, Refusal),
}

/// A friction that has settled away from the last one reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrictionChange {
    /// The axis.
    pub axis: AxisName,
    /// Its friction over what was commissioned, percent.
    pub percent: u16,
    /// True if the change asks for maintenance: beyond 67 to 150 %.
    pub needs_maintenance: bool,
}

/// An oscillation of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Oscillated {
    /// The axis.
    pub axis: AxisName,
    /// The finding, and the action taken.
    pub kind: OscillationKind,
    /// Frequency, 0.1 Hz.
    pub decihertz: u16,
    /// Amplitude, um.
    pub micrometres: u16,
}

/// Runs at rest with the outputs off after which a motion is reported: 0.1 s at 10 kHz.
const REST_RUNS: u8 = 100;

/// The supervisor's state: the view of its last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervisor {
    seen: StageView,
    /// Runs for which the outputs have been off and all axes at rest, up to [`REST_RUNS`].
    rested: u8,
}

/// The decision of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decision {
    /// The command for the control law's next tick.
    pub command: Option<Command>,
    /// Events: a change of state, a held fault, a change of motion, one that nobody asked for, a refusal.
    pub events: [Option<Event>; 5],
}

impl Supervisor {
    /// Compares the stage with its last view, and judges a request if there is one.
    pub fn step(&mut self, view: StageView, request: Option<Command>) -> Decision {
        let seen = core::mem::replace(&mut self.seen, view);
        let state = match view.safety {
            _ if seen.safety == view.safety => None,
            SafetyState::Start => None,
            // That a start is over is no news: nothing has changed for the outputs.
            SafetyState::Disabled if seen.safety == SafetyState::Start => None,
            SafetyState::Disabled => Some(Event::Disabled),
            SafetyState::Enabled => Some(Event::Enabled),
            SafetyState::Stopping(fault) => Some(Event::Stopping(fault)),
            SafetyState::Faulted(fault) => Some(Event::Faulted(fault)),
        };
        let held = match view.held {
            Some(fault) if seen.held != view.held => Some(Event::Held(fault)),
            _ => None,
        };
        let motion = match (seen.running, view.running) {
            (false, true) => Some(Event::MotionStarted),
            (true, false) if view.safety.is_enabled() => Some(Event::MotionFinished),
            _ => None,
        };
        let moved = view.moving.filter(|_| self.rested == REST_RUNS);
        self.rested = if view.safety.drives() || view.moving.is_some() {
            0
        } else {
            REST_RUNS.min(self.rested + 1)
        };
        let refusal = request.and_then(|command| {
            let refused = refusal_from(Station::Operator, view, command);
            refused.map(|reason| Event::Refused(command, reason))
        });
        Decision {
            command: if refusal.is_none() { request } else { None },
            events: [
                state,
                held,
                motion,
                moved.map(Event::MovedWhileOff),
                refusal,
            ],
        }
    }
}
