//! What a server tells without being asked.

use serde::{Deserialize, Serialize};

use super::motion::AxisSet;
use super::text::{Text, text};
use crate::app::supervisor;
use crate::law::axes::AxisName;
use crate::law::telemetry::TelemetryBlock;

/// What a server tells without being asked.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Notice {
    /// Something happened.
    Event {
        /// The event's number since the start, wrapping: a gap is what was dropped.
        sequence: u16,
        /// The control tick.
        tick: u32,
        /// What.
        event: Event,
    },
    /// Samples.
    Telemetry(TelemetryBlock),
    /// A line of the log.
    Log(Text),
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Event {
    /// The firmware started; the text says why.
    Started(Text),
    /// The outputs were switched on.
    Enabled,
    /// The outputs were switched off.
    Disabled,
    /// A fault was latched.
    Fault {
        /// Its stable number.
        code: u8,
        /// The axis, if it is one axis' fault.
        axis: Option<AxisName>,
    },
    /// A fault was found, and the axes brake; then it is latched.
    Stopping {
        /// Its stable number.
        code: u8,
        /// The axis, if it is one axis' fault.
        axis: Option<AxisName>,
    },
    /// A fault was found, and the axes brake and hold; it is not latched.
    Held {
        /// Its stable number.
        code: u8,
        /// The axis, if it is one axis' fault.
        axis: Option<AxisName>,
    },
    /// A motion began.
    MotionStarted,
    /// All motions came to their end.
    MotionFinished,
    /// The control side refused what the link had let through.
    Refused(Text),
    /// An axis found its home position.
    Homed(AxisName),
    /// A capture can be read.
    CaptureFrozen {
        /// Its number.
        number: u16,
    },
    /// Other settings act now.
    SettingsApplied(AxisSet),
    /// The settings are kept for the next start.
    SettingsStored,
}

impl From<supervisor::Event> for Event {
    fn from(event: supervisor::Event) -> Self {
        match event {
            supervisor::Event::Enabled => Self::Enabled,
            supervisor::Event::Disabled => Self::Disabled,
            supervisor::Event::Faulted(fault) => Self::Fault {
                code: fault.code.number(),
                axis: fault.axis,
            },
            supervisor::Event::Stopping(fault) => Self::Stopping {
                code: fault.code.number(),
                axis: fault.axis,
            },
            supervisor::Event::Held(fault) => Self::Held {
                code: fault.code.number(),
                axis: fault.axis,
            },
            supervisor::Event::MotionStarted => Self::MotionStarted,
            supervisor::Event::MotionFinished => Self::MotionFinished,
            supervisor::Event::Refused(_, reason) => Self::Refused(text(format_args!("{reason}"))),
        }
    }
}
