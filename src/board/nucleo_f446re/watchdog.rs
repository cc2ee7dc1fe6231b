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
/// Prescaler bits of 4 and 256 (IWDG_PR).
const PRESCALE_4: u8 = 0;
const PRESCALE_256: u8 = 6;
/// Reload value while the firmware starts: 8 s in steps of 8 ms, at a prescaler of 256; 5.4 to 15 s with that oscillator. A start
/// takes less than 2 s.
const START_RELOAD: u16 = 999;
/// Looks until a new prescaler or reload value is in force: it takes five cycles of the prescaled oscillator, 75 ms at most.
const PATIENCE: u32 = 1_000_000;

/// The independent watchdog.
pub(crate) struct Watchdog {
    watchdog: IWDG,
    debugger: DBGMCU,
}

impl Watchdog {
    /// The watchdog, which gives the firmware seconds to start: a processor that stands still before the first tick is reset, too.
    pub(super) fn new(watchdog: IWDG, debugger: DBGMCU) -> Self {
        let mut new = Self { watchdog, debugger };
        new.allow(PRESCALE_256, START_RELOAD);
        hal::Watchdog::feed(&mut new, false);
        new
    }

    /// Starts it, or changes its time.
    fn allow(&mut self, prescaler: u8, reload: u16) {
        self.key(KEY_START);
        self.key(KEY_ACCESS);
        self.watchdog.pr().write(|w| w.pr().set(prescaler));
        self.watchdog.rlr().write(|w| w.rl().set(reload));
        for _ in 0..PATIENCE {
            let status = self.watchdog.sr().read();
            if !status.rvu().bit_is_set() && !status.pvu().bit_is_set() {
                break;
            }
        }
        self.key(KEY_RELOAD);
    }

    #[inline(always)]
    fn key(&self, key: u16) {
        // SAFETY: the value is one of the manual's keys.
        self.watchdog.kr().write(|w| unsafe { w.bits(key) });
    }
}

impl hal::Watchdog for Watchdog {
    fn start(&mut self) {
        self.allow(PRESCALE_4, RELOAD);
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
