//! Flash for stored settings: sectors 1 and 2, 16 KiB each, between the vectors and the code.
//!
//! The chip has one bank: while it erases or programs, nothing can be read from flash, and a processor that fetches from
//! it stands still. Programming a word takes 16 us (100 us at most), erasing a sector 250 ms (500 ms at most): **only
//! while the amplifiers are disabled**. An erase runs from RAM with interrupts off, feeds the watchdog and follows the
//! encoders meanwhile; it does not begin while the enable line is high. What the serial port receives for longer than its ring lasts is lost.

use core::ptr::{read_volatile, write_volatile};

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};
use quadrant::hal;
use stm32f4xx_hal::pac::{FLASH, IWDG};

use super::chip::enable_line_is_low;
use super::encoders::keep_up;
use crate::board::stm32::settings_flash::FlashError;
use crate::board::stm32::watchdog::KEY_RELOAD;

/// Address of the two sectors; the linker's map leaves them out.
const START: u32 = 0x0800_4000;
/// Bytes of a sector.
const SECTOR: u32 = 16 * 1024;
/// Number of the first sector of the settings.
const FIRST_SECTOR: u32 = 1;
/// Number of these sectors.
const SECTORS: u32 = 2;

/// FLASH_KEYR (RM0390, 3.8.3).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// FLASH_CR: program, sector erase, sector number, words of 32 bits (at 2.7 V to 3.6 V), start, lock.
const PROGRAM: u32 = 1;
const ERASE: u32 = 1 << 1;
const NUMBER: u32 = 3;
const BY_WORDS: u32 = 0b10 << 8;
const START_ERASE: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// FLASH_SR: busy, and the six errors (OPERR, WRPERR, PGAERR, PGPERR, PGSERR, RDERR), which ones clear.
const BUSY: u32 = 1 << 16;
const ERRORS: u32 = 1 << 1 | 0b1_1111 << 4;
/// FLASH_ACR: data cache enabled, and its reset.
const DATA_CACHE: u32 = 1 << 10;
const DATA_CACHE_RESET: u32 = 1 << 12;
/// Largest number of polls of the busy bit of an erase before the watchdog is no longer fed: a look takes at least 20 cycles, as
/// three of its accesses cross a bus bridge, so this is at least one second at 180 MHz.
const ERASE_LOOKS: u32 = 9_000_000;
/// The same for a word: at least 1 ms, and the processor waits by itself, as it fetches from the same flash.
const PROGRAM_LOOKS: u32 = 20_000;

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
        for key in KEYS {
            // SAFETY: the keys are the manual's.
            self.flash.keyr().write(|w| unsafe { w.bits(key) });
        }
        // SAFETY: ones clear the errors of earlier times.
        self.flash.sr().write(|w| unsafe { w.bits(ERRORS) });
        let result = body(self);
        // SAFETY: nothing but the lock is set, so no program or erase is left selected.
        self.flash.cr().write(|w| unsafe { w.bits(LOCK) });
        // What the cache holds of these sectors is of yesterday.
        // SAFETY: the cache may be reset while it is disabled (RM0390, 3.4.2), and is enabled again as it was.
        unsafe {
            self.flash
                .acr()
                .modify(|r, w| w.bits(r.bits() & !DATA_CACHE));
            self.flash
                .acr()
                .modify(|r, w| w.bits(r.bits() | DATA_CACHE_RESET));
            self.flash
                .acr()
                .modify(|r, w| w.bits(r.bits() & !DATA_CACHE_RESET | DATA_CACHE));
        }
        result
    }

    /// Checks the result of the last operation.
    fn outcome(&self) -> Result<(), FlashError> {
        match self.flash.sr().read().bits() {
            status if status & BUSY != 0 => Err(FlashError::Stuck),
            status if status & ERRORS != 0 => Err(FlashError::Controller(status & ERRORS)),
            _ => Ok(()),
        }
    }

    /// Waits until the controller is idle, with a limit.
    fn wait(&self) {
        for _ in 0..PROGRAM_LOOKS {
            if self.flash.sr().read().bits() & BUSY == 0 {
                break;
            }
        }
    }

    fn erase_sector(&mut self, sector: u32) -> Result<(), FlashError> {
        self.unlocked(|this| {
            let select = ERASE | BY_WORDS | (FIRST_SECTOR + sector) << NUMBER;
            // With interrupts off, so that nothing enables them between the look and the erase.
            cortex_m::interrupt::free(|_| {
                if !enable_line_is_low() {
                    return Err(FlashError::OutputsOn);
                }
                // SAFETY: the value is the manual's; the sector is one of the two. The second write starts the erase, so
                // that nothing is fetched from flash until it is over.
                unsafe {
                    this.flash.cr().write(|w| w.bits(select));
                    erase_from_ram(
                        this.flash.cr().as_ptr(),
                        this.flash.sr().as_ptr(),
                        select | START_ERASE,
                    );
                }
                Ok(())
            })?;
            this.outcome()
        })
    }

    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.unlocked(|this| {
            // SAFETY: the value is the manual's.
            this.flash
                .cr()
                .write(|w| unsafe { w.bits(PROGRAM | BY_WORDS) });
            let addresses = (START + offset..).step_by(4);
            for (address, word) in addresses.zip(bytes.chunks_exact(4)) {
                let mut value = [0; 4];
                value.copy_from_slice(word);
                // SAFETY: a word inside the sectors, as the caller has checked; no Rust object is there.
                unsafe { write_volatile(address as *mut u32, u32::from_le_bytes(value)) };
                this.wait();
                this.outcome()?;
            }
            Ok(())
        })
    }
}

/// Starts an erase and waits for its end, in RAM; calls nothing, as everything else is in flash: `cargo xtask sizes` looks
/// into the image for that.
///
/// # Safety
/// `control` and `status` are FLASH_CR and FLASH_SR, unlocked; interrupts are disabled; `start` selects a sector that
/// nothing lives in.
#[inline(never)]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".data.erase_from_ram")]
unsafe extern "C" fn erase_from_ram(control: *mut u32, status: *mut u32, start: u32) {
    // SAFETY: the watchdog's key register always exists, and a reload of a watchdog that was not started does nothing.
    unsafe {
        let watchdog = (*IWDG::ptr()).kr().as_ptr();
        write_volatile(control, start);
        // Until the write has arrived, the busy bit says nothing.
        cortex_m::asm::dsb();
        for _ in 0..ERASE_LOOKS {
            if read_volatile(status) & BUSY == 0 {
                break;
            }
            write_volatile(watchdog, KEY_RELOAD);
            keep_up();
        }
    }
}

impl ErrorType for SettingsFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        for (address, byte) in (START + offset..).zip(bytes) {
            // SAFETY: inside the sectors, which the controller may change: hence volatile.
            *byte = unsafe { read_volatile(address as *const u8) };
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
    const WRITE_SIZE: usize = 4;
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
        for (address, byte) in (START + offset..).zip(bytes) {
            // SAFETY: as in `read`.
            if unsafe { read_volatile(address as *const u8) } != *byte {
                return Err(FlashError::Verify);
            }
        }
        Ok(())
    }
}

/// Bits can be cleared word by word as often as one likes.
impl MultiwriteNorFlash for SettingsFlash {}
