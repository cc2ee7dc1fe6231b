//! One sector of the flash, as sequential-storage sees it: nothing but this sector, and only what is allowed.

use core::cell::Cell;

use embedded_storage::nor_flash::NorFlash;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash as AsyncNorFlash, NorFlashError, NorFlashErrorKind,
    ReadNorFlash as AsyncReadNorFlash,
};

/// Kind of access to a sector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Access {
    /// It is read.
    Read,
    /// Blank words may be written.
    Append,
}

/// A sector of a blocking flash; every operation is done when its future is first polled.
pub(super) struct Sector<'f, F> {
    pub(super) flash: &'f mut F,
    /// Its first address, in the flash's own offsets.
    pub(super) start: u32,
    pub(super) access: Access,
    /// The end of what was read last, in the sector.
    pub(super) read_to: &'f Cell<u32>,
}

/// Reason why an operation on a sector failed.
#[derive(Debug)]
pub(super) enum SectorError<E> {
    /// The flash failed.
    Flash(E),
    /// It is not allowed: a write to a word that is not blank, an erasure, or either while reading.
    Forbidden,
}

impl<E: NorFlashError> NorFlashError for SectorError<E> {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Flash(error) => error.kind(),
            Self::Forbidden => NorFlashErrorKind::Other,
        }
    }
}

impl<F: NorFlash> ErrorType for Sector<'_, F> {
    type Error = SectorError<F::Error>;
}

impl<F: NorFlash> AsyncReadNorFlash for Sector<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.read_to.set(offset + bytes.len() as u32);
        let read = self.flash.read(self.start + offset, bytes);
        read.map_err(SectorError::Flash)
    }

    fn capacity(&self) -> usize {
        F::ERASE_SIZE
    }
}

impl<F: NorFlash> Sector<'_, F> {
    /// True if a stretch of the sector reads as erased.
    pub(super) fn is_blank(
        &mut self,
        offset: u32,
        length: usize,
    ) -> Result<bool, SectorError<F::Error>> {
        const CHUNK: usize = 32;
        let mut chunk = [0; CHUNK];
        let mut done = 0;
        while done < length {
            let step = CHUNK.min(length - done);
            let room = chunk.get_mut(..step).unwrap_or_default();
            let at = self.start + offset + done as u32;
            self.flash.read(at, room).map_err(SectorError::Flash)?;
            if room.iter().any(|&byte| byte != 0xFF) {
                return Ok(false);
            }
            done += step;
        }
        Ok(true)
    }
}

impl<F: NorFlash> AsyncNorFlash for Sector<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, _from: u32, _to: u32) -> Result<(), Self::Error> {
        Err(SectorError::Forbidden)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        if self.access != Access::Append || !self.is_blank(offset, bytes.len())? {
            return Err(SectorError::Forbidden);
        }
        let written = self.flash.write(self.start + offset, bytes);
        written.map_err(SectorError::Flash)
    }
}
