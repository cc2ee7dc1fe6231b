//! Errors: the reasons for which a request is not done.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::text::Text;

/// The reason for which a request was not done. The texts name the field or state, its value, and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LinkError {
    /// The request is of another version of the protocol. Stays the first error in every version.
    Version {
        /// The version of the request.
        yours: u8,
        /// The version that the server speaks.
        mine: u8,
    },
    /// The request is none of this version.
    Undecodable,
    /// No client has said hello since the server started.
    NoHello,
    /// The server has no such thing.
    Unsupported(Text),
    /// Something before it is not done yet; the same request may do later.
    Busy(Text),
    /// The machine's state does not allow it.
    Refused(Text),
    /// A value is not allowed.
    Invalid(Text),
    /// The memory for settings failed.
    Storage(Text),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version { yours, mine } => write!(
                f,
                "the request is of protocol version {yours}, the firmware speaks version {mine}; use host tools and \
                 firmware of one release"
            ),
            Self::Undecodable => f.write_str(
                "the request is not one that the firmware knows; use host tools and firmware of one release",
            ),
            Self::NoHello => {
                f.write_str("no session is open, the board may have restarted; connect again")
            }
            Self::Unsupported(text) => write!(f, "not supported: {text}"),
            Self::Busy(text) => write!(f, "busy: {text}"),
            Self::Refused(text) => write!(f, "refused: {text}"),
            Self::Invalid(text) => f.write_str(text),
            Self::Storage(text) => write!(f, "storage: {text}"),
        }
    }
}

impl core::error::Error for LinkError {}
