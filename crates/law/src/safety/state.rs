//! The safety states, and their changes by faults and commands.

use super::fault::{Fault, Reaction};
use crate::command::Command;

/// The safety state: it alone decides who drives the outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SafetyState {
    /// Nobody: no good inputs have been seen yet. The state at start.
    #[default]
    Start,
    /// Nobody: zero volts, amplifiers disabled.
    Disabled,
    /// The control law drives the outputs.
    Enabled,
    /// The control law drives the outputs through a controlled stop (IEC 60204-1, category 1); then the fault is latched.
    Stopping(Fault),
    /// Nobody, until a reset.
    Faulted(Fault),
}

impl SafetyState {
    /// True if the outputs are enabled by request, and nothing is about to end that.
    pub const fn is_enabled(self) -> bool {
        matches!(self, Self::Enabled)
    }

    /// True if the control law drives the outputs: enabled, or in a controlled stop after a fault.
    pub const fn drives(self) -> bool {
        matches!(self, Self::Enabled | Self::Stopping(_))
    }

    /// The fault that is latched, or will be once the axes stand.
    pub const fn fault(self) -> Option<Fault> {
        match self {
            Self::Stopping(fault) | Self::Faulted(fault) => Some(fault),
            _ => None,
        }
    }

    /// Latches a fault; the first one stays, but one that calls for switching off ends a stop under control.
    #[inline(always)]
    pub(crate) fn trip(&mut self, fault: Fault, reaction: Reaction) {
        *self = match (*self, reaction) {
            (Self::Faulted(first), _) | (Self::Stopping(first), Reaction::Off) => {
                Self::Faulted(first)
            }
            (Self::Stopping(first), _) => Self::Stopping(first),
            (_, Reaction::Off) => Self::Faulted(fault),
            (Self::Enabled, Reaction::Stop) => Self::Stopping(fault),
            (other, _) => other,
        }
    }

    /// Takes a command that [`admission`](crate::admission) has let through; returns true if the outputs have just
    /// been enabled.
    #[inline(always)]
    pub fn apply(&mut self, command: Command) -> bool {
        match (command, *self) {
            (Command::Enable, Self::Disabled) => {
                *self = Self::Enabled;
                return true;
            }
            (Command::Disable, Self::Enabled) | (Command::ResetFault, Self::Faulted(_)) => {
                *self = Self::Disabled;
            }
            (Command::Disable, Self::Stopping(fault)) => *self = Self::Faulted(fault),
            _ => {}
        }
        false
    }
}
