//! One frame on its way out.

use serde::Serialize;

use crate::hal::Serial;
use crate::link::frame::{self, FRAME_BYTES};

/// A frame, and how much of it has been sent.
#[derive(Debug)]
pub(super) struct Outbox {
    frame: [u8; FRAME_BYTES],
    length: usize,
    sent: usize,
}

impl Outbox {
    pub(super) const fn new() -> Self {
        Self {
            frame: [0; FRAME_BYTES],
            length: 0,
            sent: 0,
        }
    }

    /// Sends what the port takes; says whether all of it is gone.
    pub(super) fn flush(&mut self, serial: &mut impl Serial) -> bool {
        let rest = self.frame.get(self.sent..self.length).unwrap_or(&[]);
        if !rest.is_empty() {
            self.sent += serial.write(rest);
        }
        self.sent >= self.length
    }

    /// Puts a message in the place of one that is gone.
    pub(super) fn fill(&mut self, message: &impl Serialize) {
        self.sent = 0;
        // Every message fits: their types bound them, and a test holds the largest against a frame.
        self.length = frame::encode(message, &mut self.frame).map_or(0, <[u8]>::len);
    }
}
