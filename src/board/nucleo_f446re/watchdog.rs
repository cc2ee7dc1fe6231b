//! The independent watchdog, and what else guards the processor: why it was reset, and how well it is supplied.

use quadrant::hal::{self, ResetCause};
use stm32f4xx_hal::pac::{DBGMCU, FLASH, IWDG, PWR, RCC};

use super::wiring;

/// IWDG_KR (RM0390, 20.4.1): starts, reloads, and gives access to prescaler and reload value.
pub(super) const KEY_START: u16 = 0xCCCC;
pub(super) const KEY_RELOAD: u16 = 0xAAAA;
const KEY_ACCESS: u16 = 0x5555;
/// Reload value: 10 ms in steps of 125 us, at a prescaler of 4 (the value after reset) and 32 kHz. The oscillator may
/// have 17 to 47 kHz: the watchdog bites after 6.8 to 18.8 ms.
const RELOAD: u16 = 79;
/// Cycles of the watchdog's oscillator until a new reload value is in force: five; this is far more.
const PATIENCE: u32 = 1_000_000;

/// The independent watchdog.
pub(crate) struct Watchdog {
    watchdog: IWDG,
    debugger: DBGMCU,
}

impl Watchdog {
    /// The watchdog, not started.
    pub(super) fn new(watchdog: IWDG, debugger: DBGMCU) -> Self {
        Self { watchdog, debugger }
    }

    #[inline(always)]
    fn key(&self, key: u16) {
        // SAFETY: the value is one of the manual's keys.
        self.watchdog.kr().write(|w| unsafe { w.bits(key) });
    }
}

impl hal::Watchdog for Watchdog {
    fn start(&mut self) {
        self.key(KEY_START);
        self.key(KEY_ACCESS);
        self.watchdog.rlr().write(|w| w.rl().set(RELOAD));
        for _ in 0..PATIENCE {
            if !self.watchdog.sr().read().rvu().bit_is_set() {
                break;
            }
        }
        self.key(KEY_RELOAD);
    }

    /// A breakpoint freezes the watchdog as long as the amplifiers are off; once they are on, a halted processor is reset,
    /// and its outputs go off.
    #[inline(always)]
    fn feed(&mut self, driving: bool) {
        self.debugger
            .apb1_fz()
            .modify(|_, w| w.dbg_iwdg_stop().bit(!driving));
        self.key(KEY_RELOAD);
    }
}

/// Reads why the processor was reset, and clears the flags for the next time.
pub(super) fn reset_cause(rcc: &RCC) -> ResetCause {
    let cause = wiring::reset_cause(rcc.csr().read().bits());
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    cause
}

/// The processor's supply.
#[allow(dead_code, reason = "whether it is watched is up to the application")]
pub(crate) struct Supply {
    power: PWR,
}

impl Supply {
    /// Starts to watch the supply, at 2.9 V falling; the power controller is clocked.
    pub(super) fn new(power: PWR) -> Self {
        // PWR_CR: highest threshold (PLS = 111), detector on (PVDE).
        power
            .cr()
            .modify(|_, w| w.pls().set(0b111).pvde().set_bit());
        Self { power }
    }

    /// Whether the supply is below 2.9 V at present (PWR_CSR, PVDO).
    #[allow(dead_code, reason = "whether it is watched is up to the application")]
    pub(crate) fn is_low(&self) -> bool {
        self.power.csr().read().pvdo().bit_is_set()
    }
}

/// The threshold below which the supply resets the processor, in words: an option of the chip, kept in its flash.
///
/// At 180 MHz and three wait states' worth of flash, level 3 (2.7 V) is the right one; the factory's is off, 1.7 V.
pub(super) fn brown_out_level(flash: &FLASH) -> &'static str {
    // FLASH_OPTCR (RM0390, 3.8.6), BOR_LEV.
    match flash.optcr().read().bits() >> 2 & 0b11 {
        0b00 => "level 3, 2.7 V",
        0b01 => "level 2, 2.4 V",
        0b10 => "level 1, 2.1 V",
        _ => "off, 1.7 V",
    }
}
