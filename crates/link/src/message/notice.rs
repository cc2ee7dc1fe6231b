//! Notices: messages that a server sends of its own accord.

use serde::{Deserialize, Serialize};

use super::axis::{AxisName, AxisSet};
use super::observe::TelemetryBlock;
use super::text::Text;

/// A message that a server sends of its own accord.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Notice {
    /// An event.
    Event {
        /// The event's number since the start, wrapping: a gap is what was dropped.
        sequence: u16,
        /// The control tick.
        tick: u32,
        /// The event itself.
        event: Event,
    },
    /// Samples of the present selection.
    Telemetry(TelemetryBlock),
    /// A line of the log.
    Log(Text),
}

/// An event of the machine.
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
    /// A capture is complete and can be read.
    CaptureFrozen {
        /// The capture's number.
        number: u16,
    },
    /// The applied settings are in force on these axes.
    SettingsApplied(AxisSet),
    /// Settings were stored for the next start.
    SettingsStored,
    /// An axis that stood was moved though the outputs are off.
    MovedWhileOff(AxisName),
}
