//! The transmit buffer: one frame on its way out.

use serde::Serialize;

use crate::hal::Serial;
use quadrant_link::frame::{self, FRAME_BYTES};

/// A frame, and the number of its bytes that have been sent.
#[derive(Debug)]
pub(super) struct TransmitBuffer {
    frame: [u8; FRAME_BYTES],
    length: usize,
    sent: usize,
}

impl TransmitBuffer {
    pub(super) const fn new() -> Self {
        Self {
            frame: [0; FRAME_BYTES],
            length: 0,
            sent: 0,
        }
    }

    /// Sends the bytes that the port takes; returns true if none is left.
    pub(super) fn flush(&mut self, serial: &mut impl Serial) -> bool {
        let rest = self.frame.get(self.sent..self.length).unwrap_or(&[]);
        if !rest.is_empty() {
            self.sent += serial.write(rest);
        }
        self.sent >= self.length
    }

    /// Replaces a frame that has been sent by that of a message.
    pub(super) fn fill(&mut self, message: &impl Serialize) {
        self.sent = 0;
        // Every message fits: their types bound them, and a test compares the largest with a frame.
        self.length = frame::encode(message, &mut self.frame).map_or(0, <[u8]>::len);
    }
}
