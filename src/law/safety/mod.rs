//! Who may drive the outputs: states, faults, and the monitors that find them.
//!
//! ```text
//!   Start --good inputs--> Disabled --Enable, good inputs--> Enabled --fault, Stop--> Stopping --at rest--> Faulted
//!                             ^                                 |                        |                    |
//!                             |<------------Disable-------------+------fault, Off--------+------------------->|
//!                             +------------------------------ResetFault---------------------------------------+
//! ```
//!
//! Nothing is enabled without a request, nor while an input is bad. A fault whose [`Reaction`] is to switch off does so
//! in the tick that finds it, before any other output is computed; one whose reaction is to stop brakes all axes under
//! control first. Either is latched until a person resets it, and the first one stays.
//!
//! | looks at | monitor | finds |
//! |----------|---------|-------|
//! | every reading | [`encoder`](crate::law::encoder), [`monitor`] | jump, both lines at once, stale, overspeed, silent, index |
//! | every error | [`monitor`] | following error |
//! | every reference | [`travel`], [`Switches`] | braking distance, limit switches |
//! | the board's inputs | [`Switches`] | emergency stop, amplifier fault, output mismatch |

mod fault;
pub mod monitor;
mod switches;
pub mod travel;

pub use fault::{Fault, FaultCode, Obstacle, Reaction, StreamLoss};
pub use switches::{AxisSwitches, Switches};

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::law::reference::Velocity;

/// One of the stage's three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

impl AxisName {
    /// All axes, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The axis' name in lower case.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

impl fmt::Display for AxisName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Who drives the outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SafetyState {
    /// Nobody: no good inputs have been seen yet. The state at start.
    #[default]
    Start,
    /// Nobody: zero volts, amplifiers disabled.
    Disabled,
    /// The control law.
    Enabled,
    /// The control law, while the axes brake; then the fault is latched.
    Stopping(Fault),
    /// Nobody, until a reset.
    Faulted(Fault),
}

/// What a person or a host asks of the stage. Each takes effect once, at the next tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Switch the outputs on, holding the present position. Refused while a fault is latched or an input is bad.
    Enable,
    /// Switch the outputs off.
    Disable,
    /// Clear a latched fault; the stage is then disabled.
    ResetFault,
    /// Start the plan's motions from where the axes stand. Ignored unless enabled and at rest.
    Run,
    /// Brake every axis along its braking limits and hold.
    Stop,
    /// Find out where the axis is. Ignored unless enabled, the axis at rest, and its settings say how.
    Home(AxisName),
    /// Move an axis at a velocity until another one is asked for; zero ends it. Held to the axis' largest velocity and,
    /// once it is homed, to its travel. Ignored unless enabled, and the axis at rest or jogging.
    Jog(AxisName, Velocity),
    /// Start the plan's motion of one axis, whatever the others do. Ignored unless enabled and the axis at rest.
    StartMove(AxisName),
    /// Start the stream whose first segments the axes have. Ignored unless enabled, all at rest, and the segments there.
    StartStream,
    /// Begin the injection that is ready: a voltage added to an axis' output. Ignored unless enabled, and all axes at rest.
    StartInjection,
}

impl Command {
    /// The command of a number on the lockstep channel.
    pub const fn from_number(number: u32) -> Option<Self> {
        Some(match number {
            1 => Self::Enable,
            2 => Self::Disable,
            3 => Self::ResetFault,
            4 => Self::Run,
            5 => Self::Stop,
            6 => Self::StartStream,
            7 => Self::StartInjection,
            8 => Self::Home(AxisName::X),
            9 => Self::Home(AxisName::Y),
            10 => Self::Home(AxisName::Z),
            12 => Self::StartMove(AxisName::X),
            13 => Self::StartMove(AxisName::Y),
            14 => Self::StartMove(AxisName::Z),
            _ => return None,
        })
    }

    /// The number on the lockstep channel; a jog has none, for it carries a velocity.
    pub const fn number(self) -> Option<u32> {
        Some(match self {
            Self::Enable => 1,
            Self::Disable => 2,
            Self::ResetFault => 3,
            Self::Run => 4,
            Self::Stop => 5,
            Self::StartStream => 6,
            Self::StartInjection => 7,
            Self::Home(axis) => 8 + axis as u32,
            Self::StartMove(axis) => 12 + axis as u32,
            Self::Jog(..) => return None,
        })
    }

    /// The axis that it is about, if it is about one.
    pub const fn axis(self) -> Option<AxisName> {
        match self {
            Self::Home(axis) | Self::Jog(axis, _) | Self::StartMove(axis) => Some(axis),
            _ => None,
        }
    }
}

impl SafetyState {
    /// Whether the outputs are enabled by request, and nothing is about to end that.
    #[inline(always)]
    pub const fn is_enabled(self) -> bool {
        matches!(self, Self::Enabled)
    }

    /// Whether the control law drives the outputs: enabled, or braking after a fault.
    #[inline(always)]
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
    pub fn trip(&mut self, fault: Fault, reaction: Reaction) {
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

    /// Takes a command; says whether the outputs have just been enabled. `obstructed`: an input is bad.
    #[inline(always)]
    pub fn apply(&mut self, command: Command, obstructed: bool) -> bool {
        match (command, *self) {
            (Command::Enable, Self::Disabled) if !obstructed => {
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
