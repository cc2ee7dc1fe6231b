//! Flash for stored settings: the last two sectors of bank 2, 128 KiB each.
//!
//! The image runs from bank 1, so the processor goes on while bank 2 erases or programs (RM0433, 4.3.11); neither begins while the
//! amplifiers are enabled all the same, as on other boards. It is written by flash words of 32 bytes with a checksum each (ECC,
//! 4.3.12), every one once after an erasure. One that a power cut left half written may have two wrong bits or more: reading it is a bus
//! error (4.7.7 to 4.7.9), which is met here, and reads as zeros, which is neither blank nor any item.

use core::arch::asm;
use core::ptr::{read_volatile, write_volatile};

use cortex_m::peripheral::SCB;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};
use quadrant::hal;
use stm32h7::stm32h743v::FLASH;

use super::chip::enable_line_is_low;
use crate::board::stm32::settings_flash::FlashError;

/// Address of the two sectors; the linker's map leaves bank 2 out.
pub(super) const START: u32 = 0x081C_0000;
/// Bytes of a sector.
const SECTOR: u32 = 128 * 1024;
/// Number of the first sector of the settings in bank 2.
const FIRST_SECTOR: u32 = 6;
/// Number of these sectors.
const SECTORS: u32 = 2;
/// Bytes of a flash word, and how many words of the processor that is.
const FLASH_WORD: usize = 32;
const WORDS: usize = FLASH_WORD / 4;

/// FLASH_KEYR2 (RM0433, 4.9.24; 4.5.1).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// FLASH_CR2 (4.9.25): lock, program, sector erase, 32 bits at a time (PSIZE2 = 10), start, sector number (SNB2).
const LOCK: u32 = 1;
const PROGRAM: u32 = 1 << 1;
const ERASE: u32 = 1 << 2;
const BY_WORDS: u32 = 0b10 << 4;
const START_ERASE: u32 = 1 << 7;
const NUMBER: u32 = 8;
/// FLASH_SR2 (4.9.26): something under way or waiting (BSY2, WBNE2, QW2); the errors of a program or an erasure (WRPERR2, PGSERR2,
/// STRBERR2, INCERR2, OPERR2); two wrong bits in a word that was read (DBECCERR2).
const BUSY: u32 = 0b111;
const ERRORS: u32 = 1 << 22 | 1 << 21 | 1 << 19 | 1 << 18 | 1 << 17;
const WRONG_BITS: u32 = 1 << 26;
/// FLASH_CCR2 (4.9.27): clears those, one wrong bit that was corrected (SNECCERR2), and the end of an operation (EOP2).
const CLEAR: u32 = ERRORS | WRONG_BITS | 1 << 25 | 1 << 16;
/// SCB_CCR (Armv7-M, B3.2.8), BFHFNMIGN: at priority -1 and above, bus errors of loads are ignored.
const IGNORE_BUS_ERRORS: u32 = 1 << 8;
/// Largest number of polls before giving up: a look crosses two buses, so it takes at least 20 cycles and no more than 200. An
/// erasure takes 4 s at most (DS12110, table 140), a word well below 1 ms.
const ERASE_LOOKS: u32 = 100_000_000;
const PROGRAM_LOOKS: u32 = 100_000;

/// The two sectors.
pub(crate) struct SettingsFlash {
    flash: FLASH,
}

impl SettingsFlash {
    /// The two sectors, locked.
    pub(super) fn new(flash: FLASH) -> Self {
        Self { flash }
    }

    /// Does something with an unlocked controller.
    fn unlocked(
        &mut self,
        body: impl FnOnce(&mut Self) -> Result<(), FlashError>,
    ) -> Result<(), FlashError> {
        let bank = self.flash.bank2();
        // SAFETY: keys and flags are the manual's.
        unsafe {
            for key in KEYS {
                bank.keyr().write(|w| w.bits(key));
            }
            bank.ccr().write(|w| w.bits(CLEAR));
        }
        let result = body(self);
        // SAFETY: nothing but the lock is set in the end, so no program or erase is left selected.
        unsafe {
            self.flash.bank2().cr().write(|w| w.bits(BY_WORDS));
            self.flash.bank2().cr().write(|w| w.bits(BY_WORDS | LOCK));
        }
        result
    }

    /// Waits for the end of what was started, with a limit, and checks its result.
    fn finish(&self, looks: u32) -> Result<(), FlashError> {
        for _ in 0..looks {
            let status = self.flash.bank2().sr().read().bits();
            if status & ERRORS != 0 {
                return Err(FlashError::Controller(status & ERRORS));
            }
            if status & BUSY == 0 {
                return Ok(());
            }
        }
        Err(FlashError::Stuck)
    }

    fn erase_sector(&mut self, sector: u32) -> Result<(), FlashError> {
        self.unlocked(|this| {
            let select = ERASE | BY_WORDS | (FIRST_SECTOR + sector) << NUMBER;
            // With interrupts off, so that nothing enables the amplifiers between the look and the start.
            cortex_m::interrupt::free(|_| {
                if !enable_line_is_low() {
                    return Err(FlashError::OutputsOn);
                }
                let control = this.flash.bank2().cr();
                // SAFETY: the value is the manual's; the sector is one of the two.
                unsafe {
                    control.write(|w| w.bits(select));
                    control.write(|w| w.bits(select | START_ERASE));
                }
                Ok(())
            })?;
            this.finish(ERASE_LOOKS)
        })
    }

    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.unlocked(|this| {
            let addresses = (START + offset..).step_by(FLASH_WORD);
            for (address, word) in addresses.zip(bytes.chunks_exact(FLASH_WORD)) {
                // SAFETY: the value is the manual's.
                this.flash
                    .bank2()
                    .cr()
                    .write(|w| unsafe { w.bits(PROGRAM | BY_WORDS) });
                for (place, part) in (address..).step_by(4).zip(word.chunks_exact(4)) {
                    let mut value = [0; 4];
                    value.copy_from_slice(part);
                    // SAFETY: inside the sectors, as the caller has checked; no Rust object is there. Device memory: the eight
                    // stores arrive one by one and in order, and the last one starts the programming (4.3.9).
                    unsafe { write_volatile(place as *mut u32, u32::from_le_bytes(value)) };
                }
                cortex_m::asm::dsb();
                this.finish(PROGRAM_LOOKS)?;
            }
            Ok(())
        })
    }

    /// Reads a flash word: zeros, if it cannot be.
    fn read_word(&mut self, address: u32) -> [u8; FLASH_WORD] {
        let bank = self.flash.bank2();
        let mut words = [0_u32; WORDS];
        // SAFETY: reads inside the sectors, which the controller may change: hence volatile. For the time of eight reads, below 1 us,
        // FAULTMASK holds up every interrupt and has bus errors ignored, which only these reads can cause; both end here.
        unsafe {
            let control = &(*SCB::PTR).ccr;
            asm!("cpsid f", options(nostack, preserves_flags));
            control.modify(|bits| bits | IGNORE_BUS_ERRORS);
            cortex_m::asm::dsb();
            cortex_m::asm::isb();
            for (place, word) in (address..).step_by(4).zip(&mut words) {
                *word = read_volatile(place as *const u32);
            }
            cortex_m::asm::dsb();
            control.modify(|bits| bits & !IGNORE_BUS_ERRORS);
            cortex_m::asm::dsb();
            asm!("cpsie f", options(nostack, preserves_flags));
        }
        if bank.sr().read().bits() & WRONG_BITS != 0 {
            // SAFETY: ones clear these flags.
            bank.ccr().write(|w| unsafe { w.bits(WRONG_BITS) });
            return [0; FLASH_WORD];
        }
        let mut bytes = [0; FLASH_WORD];
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }
}

impl ErrorType for SettingsFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        let mut address = START + offset;
        let mut rest = bytes;
        while !rest.is_empty() {
            let within = address as usize % FLASH_WORD;
            let word = self.read_word(address - within as u32);
            let count = (FLASH_WORD - within).min(rest.len());
            let (now, later) = rest.split_at_mut(count);
            for (byte, read) in now.iter_mut().zip(word.iter().skip(within)) {
                *byte = *read;
            }
            address += count as u32;
            rest = later;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        (SECTORS * SECTOR) as usize
    }
}

impl hal::SettingsFlash for SettingsFlash {
    fn outputs_are_off(&self) -> bool {
        enable_line_is_low()
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = FLASH_WORD;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to)?;
        for sector in from / SECTOR..to / SECTOR {
            self.erase_sector(sector)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        self.program(offset, bytes)?;
        for (address, word) in (START + offset..)
            .step_by(FLASH_WORD)
            .zip(bytes.chunks_exact(FLASH_WORD))
        {
            if self.read_word(address) != *word {
                return Err(FlashError::Verify);
            }
        }
        Ok(())
    }
}
