//! Errors of a session with a machine.

use std::io;
use std::time::Duration;

use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::message::LinkError;
use quadrant_settings::tree::TreeError;

/// Reason why a request was not carried out.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The connection is broken.
    #[error("{endpoint}: {source}; {remedy}")]
    Connection {
        endpoint: String,
        source: io::Error,
        remedy: &'static str,
    },
    /// No answer came in time.
    #[error(
        "{what}: no answer from {endpoint} within {waited_ms} ms, asked {attempts} times; {remedy}"
    )]
    Silent {
        what: &'static str,
        endpoint: String,
        /// Waiting time of all attempts, ms.
        waited_ms: u128,
        /// Number of attempts that were made.
        attempts: u32,
        remedy: &'static str,
    },
    /// No answer came to a request that must not be made twice.
    #[error(
        "{what}: no answer from {endpoint} within {waited_ms} ms; it may have been done or not, and doing it twice may harm, so it \
         was not asked again: look at `status`"
    )]
    Unsure {
        what: &'static str,
        endpoint: String,
        /// Time waited for it, ms.
        waited_ms: u128,
    },
    /// The other end is of another release.
    #[error(
        "{endpoint} speaks protocol version {theirs}, this program version {PROTOCOL_VERSION}; use the program of the firmware's \
         release, or flash the firmware of this one (`quadrant connect flash`)"
    )]
    Version {
        endpoint: String,
        /// Protocol version of the machine.
        theirs: u8,
    },
    /// Somebody asked to stop: see [`Interrupt`](super::Interrupt).
    #[error("interrupted: {done}")]
    Interrupted {
        /// State of the axes since, for the message.
        done: &'static str,
    },
    /// The machine has restarted since the session was opened.
    #[error(
        "{what}: the machine has restarted, so this was not done; the session is open again, but outputs are off and home \
         positions are lost: look at `status`"
    )]
    Restarted { what: &'static str },
    /// The machine said no.
    #[error("{what}: {source}")]
    Refused {
        what: &'static str,
        source: LinkError,
    },
    /// The machine answered something else.
    #[error(
        "{what}: {endpoint} answered with something else ({answer}); use host tools and firmware of one release"
    )]
    Unexpected {
        what: &'static str,
        endpoint: String,
        /// Name of the reply that came.
        answer: &'static str,
    },
    /// A text is longer than the link carries.
    #[error("{what}: {text:?} is {length} bytes long, the link carries {most}; shorten it")]
    TooLong {
        /// Kind of the text.
        what: &'static str,
        /// The text that is too long.
        text: String,
        /// Length of the text, bytes.
        length: usize,
        /// Longest text allowed, bytes.
        most: usize,
    },
    /// A setting that this program does not know, or a value that is none of it.
    #[error("{path}: {source}")]
    Setting {
        /// Its path, and the value if there is one.
        path: String,
        source: TreeError,
    },
    /// A latched fault ended what was waited for.
    #[error(
        "{what}: fault {code} {name}{axis} at tick {tick}: {cause}; {remedy}",
        remedy = with_reset(.remedy),
        axis = .axis.map(|axis| format!(" of {axis}")).unwrap_or_default()
    )]
    Fault {
        /// Name of the condition.
        what: &'static str,
        /// Number of the fault code.
        code: u8,
        /// Name of the fault code.
        name: String,
        /// Axis of the fault, if it has one.
        axis: Option<quadrant_law::axes::AxisName>,
        /// Control tick of the fault.
        tick: u32,
        /// Cause, as the machine words it.
        cause: String,
        remedy: String,
    },
    /// A motion is under way, which a measurement would mistake for its own.
    #[error(
        "an axis moves, or LinuxCNC leads it: `stop`, or machine off, and measure when all axes stand"
    )]
    Moving,
    /// Settings of the draft are edited, and a measurement would write its own over them.
    #[error(
        "the draft is edited and does not act ({paths}), and a measurement would write over it: `apply` or `revert` it first; what \
         needs a restart, `store` and `reboot`"
    )]
    Edited {
        /// The first path that is edited, and how many more there are.
        paths: String,
    },
    /// Settings that a machine takes with a restart alone, and that a measurement was to begin with.
    #[error(
        "the settings have another encoder or control rate than the machine, which takes those with a restart alone; nothing was changed: \
         `load` them in its console, `store` and `reboot`, then measure"
    )]
    NeedsRestart,
    /// Axes are not homed, and nothing homes them.
    #[error("wait homed: {axes} not homed, and not homing: give `home` first")]
    NotHoming {
        /// Their names.
        axes: String,
    },
    /// A condition was not met in time.
    #[error("{what}: not after {waited_s} s; {remedy}")]
    TimedOut {
        /// Name of the condition.
        what: &'static str,
        /// Time waited for it, s.
        waited_s: f64,
        remedy: &'static str,
    },
}

impl ClientError {
    /// The name of the request that failed, with which the text begins; none where no single request did.
    pub const fn request(&self) -> Option<&'static str> {
        match self {
            Self::Silent { what, .. }
            | Self::Unsure { what, .. }
            | Self::Restarted { what }
            | Self::Refused { what, .. }
            | Self::Unexpected { what, .. } => Some(what),
            _ => None,
        }
    }

    pub(super) const fn silent(
        what: &'static str,
        endpoint: String,
        waited: Duration,
        attempts: u32,
        remedy: &'static str,
    ) -> Self {
        Self::Silent {
            what,
            endpoint,
            waited_ms: waited.as_millis(),
            attempts,
            remedy,
        }
    }
}

/// Returns a fault's remedy with the `reset` that most remedies leave unsaid.
pub fn with_reset(remedy: &str) -> String {
    if remedy.contains("reset") {
        remedy.to_owned()
    } else {
        format!("{remedy}, then `reset`")
    }
}

#[cfg(test)]
mod tests {
    use super::with_reset;

    #[test]
    fn a_reset_is_reported_once() {
        assert_eq!(with_reset("find the cause"), "find the cause, then `reset`");
        assert_eq!(with_reset("reset, and enable"), "reset, and enable");
    }
}
