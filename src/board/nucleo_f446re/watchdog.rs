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
pub(super) struct Supply {
    power: PWR,
}

impl Supply {
    /// Starts to watch the supply; the power controller is clocked.
    ///
    /// PWR_CR: the last threshold but one (PLS = 110), detector on (PVDE). It is 2.85 to 2.99 V falling and 2.96 to 3.10 V
    /// rising; the last may ask for 3.21 V, which is more than the board's 3.3 V regulator promises.
    pub(super) fn new(power: PWR) -> Self {
        power
            .cr()
            .modify(|_, w| w.pls().set(0b110).pvde().set_bit());
        Self { power }
    }

    /// True if the supply is below that at present (PWR_CSR, PVDO).
    #[inline(always)]
    pub(super) fn is_low(&self) -> bool {
        self.power.csr().read().pvdo().bit_is_set()
    }
}

/// The threshold below which the supply resets the processor, in words, if it does: an option of the chip, kept in its
/// flash.
///
/// At 180 MHz with five wait states the flash needs 2.7 V (RM0390, table 5): level 3 is the right one; the factory's is off.
pub(super) fn brown_out_level(flash: &FLASH) -> Option<&'static str> {
    // FLASH_OPTCR (RM0390, 3.8.6), BOR_LEV.
    match flash.optcr().read().bits() >> 2 & 0b11 {
        0b00 => Some("level 3, 2.7 V"),
        0b01 => Some("level 2, 2.4 V"),
        0b10 => Some("level 1, 2.1 V"),
        _ => None,
    }
}
