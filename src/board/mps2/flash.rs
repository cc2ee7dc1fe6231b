//! The settings' flash: a stretch of the memory shared with the host, so that it outlives the emulator.
//!
//! Every byte lies there inverted: a memory that nobody has written reads as an erased flash.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use quadrant::hal;
use quadrant_lockstep::{FLASH, FLASH_BYTES};

use super::mailbox;

/// Size of a sector, as on the reference board.
const SECTOR_BYTES: usize = FLASH_BYTES / 2;

/// Two sectors.
pub(crate) struct SettingsFlash;

impl ErrorType for SettingsFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        for (at, byte) in (FLASH + offset as usize..).zip(bytes) {
            *byte = !mailbox::byte(at);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES
    }
}

impl hal::SettingsFlash for SettingsFlash {
    /// As the host was shown it last.
    fn outputs_are_off(&self) -> bool {
        !mailbox::is_enabled()
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        if !hal::SettingsFlash::outputs_are_off(self) {
            return Err(NorFlashErrorKind::Other);
        }
        for at in from..to {
            mailbox::set_byte(FLASH + at as usize, 0);
        }
        Ok(())
    }

    /// Bits go from one to zero only.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (at, byte) in (FLASH + offset as usize..).zip(bytes) {
            mailbox::set_byte(at, mailbox::byte(at) | !byte);
        }
        Ok(())
    }
}
