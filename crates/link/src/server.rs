//! The server's end of the link: bytes in, answers out, and admission.

use crate::PROTOCOL_VERSION;
use crate::frame::{FrameCounters, Receiver, decode_whole};
use crate::message::{Body, LinkError, Reply, Response};

/// A receiver of requests.
///
/// Until a client has said [`Body::Hello`], nothing is let through but what makes the machine safer ([`Body::Disable`],
/// [`Body::Stop`]): a client learns that the board has restarted, and a stream of bytes that is none of ours has to make a
/// greeting before it makes a request.
#[derive(Default)]
pub struct LinkServer {
    receiver: Receiver,
    greeted: bool,
}

impl LinkServer {
    /// Returns a server before the first byte, without a client.
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            greeted: false,
        }
    }

    /// Takes a byte. If it ends a request, lets `serve` act on it and returns the answer: exactly one to every frame whose
    /// CRC is right, unless its number cannot be read.
    pub fn push(
        &mut self,
        byte: u8,
        serve: impl FnOnce(Body) -> Result<Reply, LinkError>,
    ) -> Option<Response> {
        let (version, rest) = match self.receiver.push(byte)?.split_first() {
            Some((&version, rest)) => (version, rest),
            None => (PROTOCOL_VERSION, [].as_slice()),
        };
        let Ok((id, body)) = postcard::take_from_bytes::<u16>(rest) else {
            self.count_undecodable();
            return None;
        };
        let body = if version == PROTOCOL_VERSION {
            decode_whole::<Body>(body).ok_or(LinkError::Undecodable)
        } else {
            Err(LinkError::Version {
                yours: version,
                mine: PROTOCOL_VERSION,
            })
        };
        if body.is_err() {
            self.count_undecodable();
        }
        let result = body.and_then(|body| {
            self.admit(&body)?;
            body.check()?;
            serve(body)
        });
        Some(Response { id, result })
    }

    /// Counts of the frames received so far.
    pub const fn counters(&self) -> FrameCounters {
        self.receiver.counters()
    }

    /// True if a client has said hello.
    pub const fn is_greeted(&self) -> bool {
        self.greeted
    }

    /// Forgets the client: the next one has to say hello. For a connection that is known to have ended.
    pub const fn close(&mut self) {
        self.greeted = false;
    }

    fn admit(&mut self, body: &Body) -> Result<(), LinkError> {
        self.greeted |= matches!(body, Body::Hello);
        if self.greeted || matches!(body, Body::Disable | Body::Stop) {
            Ok(())
        } else {
            Err(LinkError::NoHello)
        }
    }

    const fn count_undecodable(&mut self) {
        let count = &mut self.receiver.counters.undecodable;
        *count = count.wrapping_add(1);
    }
}
