//! The buffer in the board's memory that the firmware's log goes to (SEGGER's RTT), read while the processor runs on.
//!
//! The reader of probe-rs would halt the processor to attach to it, and with it the control of the axes.

use std::ops::Range;

use anyhow::{Context, ensure};
use probe_rs::MemoryInterface;
use probe_rs::architecture::arm::ArmError;

/// Begin of the control block.
const ID: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// Offset of the first channel: after the id and the numbers of channels up and down.
const CHANNEL: u64 = 24;
/// Offsets of a channel's number of the next byte to read, and of its mode. Before them are the addresses of its name and of its
/// bytes, its size, and the number of the next byte to write.
const READ: u64 = 16;
const MODE: u64 = 20;
/// Mode that says that a probe reads: the firmware then leaves the bytes to it (`src/board/stm32/rtt.rs`).
const READ_BY_PROBE: u32 = 2;
/// The longest buffer that is believed, bytes.
const LONGEST: u32 = 1 << 16;

/// A log's buffer.
pub(super) struct LogBuffer {
    channel: u64,
}

impl LogBuffer {
    /// The buffer whose control block is at an address.
    ///
    /// # Errors
    /// No control block there; a chip that does not answer.
    pub(super) fn at(
        address: u64,
        memory: &mut dyn MemoryInterface<ArmError>,
    ) -> anyhow::Result<Self> {
        let mut id = [0; ID.len()];
        memory
            .read_8(address, &mut id)
            .context("cannot read the log")?;
        ensure!(
            id == *ID,
            "the board has no log at {address:#010x}: give the image that it was flashed with"
        );
        let channel = address + CHANNEL;
        Ok(Self { channel })
    }

    /// Takes the oldest bytes: as many as lie in one piece.
    pub(super) fn take(
        &self,
        memory: &mut dyn MemoryInterface<ArmError>,
    ) -> Result<Vec<u8>, ArmError> {
        // Each time: a restart forgets it.
        memory.write_word_32(self.channel + MODE, READ_BY_PROBE)?;
        let mut words = [0; 5];
        memory.read_32(self.channel, &mut words)?;
        let [_, buffer, size, write, read] = words;
        let piece = piece(size, write, read);
        let mut bytes = vec![0; piece.len()];
        if !bytes.is_empty() {
            memory.read_8(u64::from(buffer) + u64::from(piece.start), &mut bytes)?;
            memory.write_word_32(self.channel + READ, piece.end % size)?;
        }
        Ok(bytes)
    }
}

/// Returns the bytes of a buffer that wait to be read, up to its end. While the board starts, there are none.
fn piece(size: u32, write: u32, read: u32) -> Range<u32> {
    if size > LONGEST || read >= size || write >= size {
        0..0
    } else if write < read {
        read..size
    } else {
        read..write
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_taken_in_pieces_that_end_with_the_buffer() {
        assert_eq!(piece(1024, 10, 3), 3..10);
        assert_eq!(piece(1024, 10, 1000), 1000..1024);
        assert_eq!(piece(1024, 10, 0), 0..10);
        assert!(piece(1024, 10, 10).is_empty());
    }

    #[test]
    fn a_buffer_that_the_board_has_not_set_up_has_no_bytes() {
        assert!(piece(0, 0, 0).is_empty());
        assert!(piece(u32::MAX, 5, 3).is_empty());
        assert!(piece(1024, 2000, 3).is_empty());
        assert!(piece(1024, 5, 2000).is_empty());
    }
}
