//! A flash in memory: bits are written from one to zero, and erased a sector at a time.

use std::cell::Cell;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};
use quadrant::hal::SettingsFlash;

/// Size of a sector, as on the reference board.
const SECTOR_BYTES: usize = 16 * 1024;
/// Size of both sectors together.
pub const BYTES: usize = 2 * SECTOR_BYTES;

/// Two sectors of 16 KiB.
#[derive(Clone, Debug)]
pub struct MemoryFlash {
    bytes: Vec<u8>,
    /// The amplifiers' enable line is low.
    outputs_off: Cell<bool>,
}

impl MemoryFlash {
    /// A flash that holds `bytes`, if they are as many as it has.
    pub fn of(bytes: Vec<u8>) -> Option<Self> {
        (bytes.len() == BYTES).then_some(Self {
            bytes,
            outputs_off: Cell::new(true),
        })
    }

    /// Returns the bytes that it holds.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Sets what the enable line shows.
    pub fn set_outputs_off(&self, off: bool) {
        self.outputs_off.set(off);
    }
}

impl Default for MemoryFlash {
    fn default() -> Self {
        Self {
            bytes: vec![0xFF; BYTES],
            outputs_off: Cell::new(true),
        }
    }
}

/// An access that the flash cannot do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashError(NorFlashErrorKind);

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl ErrorType for MemoryFlash {
    type Error = FlashError;
}

impl ReadNorFlash for MemoryFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError)?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl SettingsFlash for MemoryFlash {
    fn outputs_are_off(&self) -> bool {
        self.outputs_off.get()
    }
}

impl NorFlash for MemoryFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError)?;
        self.bytes[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError)?;
        for (cell, byte) in self.bytes[offset as usize..].iter_mut().zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
}
