//! The reference model's end of the link's port: what the emulated board does with its two rings.

use quadrant::hal::Serial;
use quadrant_lockstep::LINK_BYTES;

/// A port between whose ends bytes are exchanged once a tick.
#[derive(Debug, Default)]
pub(crate) struct SerialRing {
    /// Bytes of the host that may be read.
    arrived: std::collections::VecDeque<u8>,
    /// Bytes written and not shown.
    written: Vec<u8>,
    /// Bytes shown that the host has not taken.
    on_their_way: usize,
}

impl SerialRing {
    /// Takes what the host has written by now, and how much of what it was shown it has taken; gives what it is shown now.
    pub(crate) fn exchange(&mut self, arriving: &[u8], taken: usize) -> Vec<u8> {
        self.arrived.extend(arriving);
        let shown = std::mem::take(&mut self.written);
        self.on_their_way = self.on_their_way + shown.len() - taken;
        shown
    }
}

impl Serial for SerialRing {
    fn read(&mut self, into: &mut [u8]) -> usize {
        let count = into.len().min(self.arrived.len());
        for (place, byte) in into.iter_mut().zip(self.arrived.drain(..count)) {
            *place = byte;
        }
        count
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        let room = LINK_BYTES - self.on_their_way - self.written.len();
        let count = room.min(bytes.len());
        self.written.extend(&bytes[..count]);
        count
    }
}
