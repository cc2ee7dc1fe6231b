//! A flash in memory, or in a file: bits are written from one to zero, and erased a sector at a time.

use std::cell::Cell;
use std::io;
use std::ops::Range;
use std::path::Path;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};
use quadrant::hal::SettingsFlash;

use super::flash_file::FlashFile;

/// Size of a sector, as on the reference board.
const SECTOR_BYTES: usize = 16 * 1024;
/// Size of both sectors together.
const BYTES: usize = 2 * SECTOR_BYTES;

/// Two sectors of 16 KiB.
#[derive(Clone, Debug)]
pub struct MemoryFlash {
    bytes: Vec<u8>,
    /// The amplifiers' enable line is low.
    outputs_off: Cell<bool>,
    /// The file that holds the same bytes.
    file: Option<FlashFile>,
    failure: Option<String>,
}

impl MemoryFlash {
    /// A flash whose content is kept in a file; one that is not there is made.
    ///
    /// # Errors
    /// A file that cannot be read or made, or that is no flash of this size.
    pub fn kept_in(path: &Path) -> io::Result<Self> {
        let file = FlashFile::open(path, BYTES)?;
        Ok(Self {
            bytes: file.content().to_vec(),
            file: Some(file),
            ..Self::default()
        })
    }

    /// Returns the bytes that it holds.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The reason why the file could not be written the last time; none if it could.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Sets what the enable line shows.
    pub fn set_outputs_off(&self, off: bool) {
        self.outputs_off.set(off);
    }

    /// Changes bytes, and the file with them; changes nothing if the file cannot be written.
    fn change(
        &mut self,
        range: Range<usize>,
        change: impl FnOnce(&mut [u8]),
    ) -> Result<(), FlashError> {
        let before = self.bytes[range.clone()].to_vec();
        change(&mut self.bytes[range.clone()]);
        let kept = self
            .file
            .as_mut()
            .map_or(Ok(()), |file| file.keep(&self.bytes));
        self.failure = kept.err().map(|error| error.to_string());
        if self.failure.is_none() {
            return Ok(());
        }
        self.bytes[range].copy_from_slice(&before);
        Err(FlashError::FileNotWritten)
    }
}

impl Default for MemoryFlash {
    fn default() -> Self {
        Self {
            bytes: vec![0xFF; BYTES],
            outputs_off: Cell::new(true),
            file: None,
            failure: None,
        }
    }
}

/// Reason why the flash did not do something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// Outside of it, or across its sectors.
    Access(NorFlashErrorKind),
    /// The file that keeps it could not be written.
    FileNotWritten,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Access(kind) => *kind,
            Self::FileNotWritten => NorFlashErrorKind::Other,
        }
    }
}

impl ErrorType for MemoryFlash {
    type Error = FlashError;
}

impl ReadNorFlash for MemoryFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Access)?;
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
        check_erase(self, from, to).map_err(FlashError::Access)?;
        self.change(from as usize..to as usize, |cells| cells.fill(0xFF))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Access)?;
        let from = offset as usize;
        self.change(from..from + bytes.len(), |cells| {
            for (cell, byte) in cells.iter_mut().zip(bytes) {
                *cell &= byte;
            }
        })
    }
}
