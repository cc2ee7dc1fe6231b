//! Notices: messages that a server sends of its own accord.

use core::fmt;

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
    /// The friction of an axis has settled away from what was commissioned, or from the last such event.
    FrictionChanged {
        /// The axis.
        axis: AxisName,
        /// Its friction over what was commissioned, percent.
        percent: u16,
        /// True if the change asks for maintenance.
        needs_maintenance: bool,
    },
    /// An axis oscillates, or did so until what is added to it was taken away.
    Oscillated {
        /// The axis.
        axis: AxisName,
        /// The finding, and the action taken.
        kind: OscillationKind,
        /// Frequency, 0.1 Hz.
        decihertz: u16,
        /// Amplitude, um.
        micrometres: u16,
    },
}

/// An oscillation of an axis, and what was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum OscillationKind {
    /// The axis hums at rest; nothing was done.
    Hum,
    /// The friction's feedforward swung the axis: it was taken away, and comes back slowly.
    Added,
    /// It did so for the third time, and stays away until the settings change or the outputs are off.
    AddedForGood,
}

impl fmt::Display for Event {
    /// The event in a few words.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fault = |f: &mut fmt::Formatter<'_>, before, code: &u8, axis: &Option<AxisName>| {
            write!(f, "{before}fault {code}")?;
            axis.map_or(Ok(()), |axis| write!(f, " of {axis}"))
        };
        match self {
            Self::Started(text) => write!(f, "started: {text}"),
            Self::Enabled => f.write_str("outputs on"),
            Self::Disabled => f.write_str("outputs off"),
            Self::Fault { code, axis } => fault(f, "", code, axis),
            Self::Stopping { code, axis } => fault(f, "braking for ", code, axis),
            Self::Held { code, axis } => fault(f, "braked and held for ", code, axis),
            Self::MotionStarted => f.write_str("motion begins"),
            Self::MotionFinished => f.write_str("motion ends"),
            Self::Refused(text) => write!(f, "refused: {text}"),
            Self::Homed(axis) => write!(f, "{axis} is homed"),
            Self::CaptureFrozen { number } => write!(f, "capture {number} can be read"),
            Self::SettingsApplied(_) => f.write_str("settings act"),
            Self::SettingsStored => f.write_str("settings are kept"),
            Self::MovedWhileOff(axis) => write!(f, "{axis} moves though the outputs are off"),
            Self::FrictionChanged {
                axis,
                percent,
                needs_maintenance,
            } => {
                let (whole, hundredths) = (percent / 100, percent % 100);
                write!(
                    f,
                    "friction of {axis} is {whole}.{hundredths:02} times what was commissioned"
                )?;
                match needs_maintenance {
                    true => f.write_str(": look after guide, drive and lubrication"),
                    false => Ok(()),
                }
            }
            Self::Oscillated {
                axis,
                kind,
                decihertz,
                micrometres,
            } => {
                let (hertz, tenth) = (decihertz / 10, decihertz % 10);
                let amount = format_args!("{micrometres} um at {hertz}.{tenth} Hz");
                match kind {
                    OscillationKind::Hum => write!(
                        f,
                        "{axis} hums at rest, {amount}: lower the gains, or look for what shakes it"
                    ),
                    OscillationKind::Added => write!(
                        f,
                        "the feedforward of {axis} made it swing, {amount}, and is taken away for a while: \
                         check feedforward.kind and its gains"
                    ),
                    OscillationKind::AddedForGood => write!(
                        f,
                        "the feedforward of {axis} made it swing, {amount}, and is off until the outputs are off: \
                         check feedforward.kind and its gains"
                    ),
                }
            }
        }
    }
}
