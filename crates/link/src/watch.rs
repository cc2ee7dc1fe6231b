//! Recognition of valid requests, and of those that must not wait, ahead of the server.

use crate::PROTOCOL_VERSION;
use crate::frame::{Receiver, decode_whole};
use crate::message::Body;

/// A valid request, as a [`LinkWatch`] sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// [`Body::Disable`].
    Disable,
    /// [`Body::Stop`].
    Stop,
    /// Any other.
    Other,
}

/// A receiver beside the server's: it takes the same bytes, in a task that the server cannot delay, and recognises the
/// requests that make the machine safer. The server serves them too, in their order, and answers them.
#[derive(Default)]
pub struct LinkWatch {
    receiver: Receiver,
}

impl LinkWatch {
    /// Returns a receiver before the first byte.
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
        }
    }

    /// Takes a byte; returns the request that it ends, if that is one of this version of the protocol.
    pub fn push(&mut self, byte: u8) -> Option<Seen> {
        let (&version, rest) = self.receiver.push(byte)?.split_first()?;
        if version != PROTOCOL_VERSION {
            return None;
        }
        let (_, body) = postcard::take_from_bytes::<u16>(rest).ok()?;
        Some(match decode_whole::<Body>(body)? {
            Body::Disable => Seen::Disable,
            Body::Stop => Seen::Stop,
            _ => Seen::Other,
        })
    }
}
