//! Why the machine did not do what it was asked.

use std::io;
use std::time::Duration;

use quadrant::link::PROTOCOL_VERSION;
use quadrant::link::message::LinkError;
use quadrant::settings::tree::TreeError;

/// Why the machine did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The connection is broken.
    #[error("{endpoint}: {source}; {remedy}")]
    Connection {
        /// Where.
        endpoint: String,
        /// Why.
        source: io::Error,
        /// What to check.
        remedy: &'static str,
    },
    /// No answer came.
    #[error(
        "{what}: no answer from {endpoint} within {waited_ms} ms, asked {attempts} times; {remedy}"
    )]
    Silent {
        /// What was asked.
        what: &'static str,
        /// Where.
        endpoint: String,
        /// How long was waited in all, ms.
        waited_ms: u128,
        /// How often it was asked.
        attempts: u32,
        /// What to check.
        remedy: &'static str,
    },
    /// No answer came to a request that must not be made twice.
    #[error(
        "{what}: no answer from {endpoint} within {waited_ms} ms; it may have been done or not, and doing it twice may harm, so it \
         was not asked again: look at `status`"
    )]
    Unsure {
        /// What was asked.
        what: &'static str,
        /// Where.
        endpoint: String,
        /// How long was waited, ms.
        waited_ms: u128,
    },
    /// The other end is of another release.
    #[error(
        "{endpoint} speaks protocol version {theirs}, this program version {PROTOCOL_VERSION}; use the program of the firmware's \
         release, or flash the firmware of this one (`quadrant connect flash`)"
    )]
    Version {
        /// Where.
        endpoint: String,
        /// Its version.
        theirs: u8,
    },
    /// The machine has restarted since the session was opened.
    #[error(
        "{what}: the machine has restarted, so this was not done; the session is open again, but outputs are off and home \
         positions are lost: look at `status`"
    )]
    Restarted {
        /// What was asked.
        what: &'static str,
    },
    /// The machine said no.
    #[error("{what}: {source}")]
    Refused {
        /// What was asked.
        what: &'static str,
        /// Why.
        source: LinkError,
    },
    /// The machine answered something else.
    #[error(
        "{what}: {endpoint} answered with something else ({answer}); use host tools and firmware of one release"
    )]
    Unexpected {
        /// What was asked.
        what: &'static str,
        /// Where.
        endpoint: String,
        /// What came.
        answer: &'static str,
    },
    /// A text is longer than the link carries.
    #[error("{what}: {text:?} is {length} bytes long, the link carries {most}; shorten it")]
    TooLong {
        /// What it is.
        what: &'static str,
        /// The text.
        text: String,
        /// Its length, bytes.
        length: usize,
        /// The limit, bytes.
        most: usize,
    },
    /// A setting that this program does not know, or a value that is none of it.
    #[error("{path}: {source}")]
    Setting {
        /// Its path, and the value if there is one.
        path: String,
        /// Why.
        source: TreeError,
    },
    /// A latched fault ended what was waited for.
    #[error(
        "{what}: fault {code} {name}{axis} at tick {tick}: {cause}; {remedy}",
        remedy = with_reset(.remedy),
        axis = .axis.map(|axis| format!(" of {axis}")).unwrap_or_default()
    )]
    Fault {
        /// What was waited for.
        what: &'static str,
        /// The fault's number.
        code: u8,
        /// Its name.
        name: String,
        /// Its axis.
        axis: Option<quadrant::safety::AxisName>,
        /// When.
        tick: u32,
        /// Its cause.
        cause: String,
        /// What to do.
        remedy: String,
    },
    /// What was waited for did not happen.
    #[error("{what}: not after {waited_s} s; {remedy}")]
    TimedOut {
        /// What was waited for.
        what: &'static str,
        /// How long, s.
        waited_s: f64,
        /// What to do.
        remedy: &'static str,
    },
}

impl ClientError {
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

/// What to do about a fault: most remedies leave unsaid that it is latched.
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
    fn a_reset_is_told_of_once() {
        assert_eq!(with_reset("find the cause"), "find the cause, then `reset`");
        assert_eq!(with_reset("reset, and enable"), "reset, and enable");
    }
}
