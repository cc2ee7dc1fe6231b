//! Commands to the stage.

use crate::axes::AxisName;
use crate::reference::Velocity;

/// A request of a person or a host to the stage. Each takes effect once, at the next tick.
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
    /// Start the plan's motion of one axis, independent of the others. Ignored unless enabled and the axis at rest.
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
