//! The independent watchdog.

use quadrant::hal;

use crate::board::chip::freeze_in_debug;
use crate::board::chip::pac::IWDG;

/// IWDG_KR (RM0390, 20.4.1; RM0433, 45.4.1): starts, reloads, and gives access to prescaler and reload value.
const KEY_START: u16 = 0xCCCC;
pub(crate) const KEY_RELOAD: u16 = 0xAAAA;
const KEY_ACCESS: u16 = 0x5555;
/// Reload value: 10 ms in steps of 125 us, at a prescaler of 4 (the value after reset) and 32 kHz. The F446's oscillator may
/// have 17 to 47 kHz: the watchdog bites after 6.8 to 18.8 ms. The H743's has 29.4 to 33.6 kHz: 9.5 to 10.9 ms.
const RELOAD: u16 = 79;
/// Prescaler bits of 4 and 256 (IWDG_PR).
const PRESCALE_4: u8 = 0;
const PRESCALE_256: u8 = 6;
/// Reload value while the firmware starts: 8 s in steps of 8 ms, at a prescaler of 256; 5.4 to 15 s with the F446's oscillator. A start
/// takes less than 2 s.
const START_RELOAD: u16 = 999;
/// Looks until a new prescaler or reload value is in force: it takes five cycles of the prescaled oscillator, 75 ms at most.
const PATIENCE: u32 = 1_000_000;

/// The independent watchdog.
pub(crate) struct Watchdog {
    watchdog: IWDG,
}

impl Watchdog {
    /// The watchdog, which gives the firmware seconds to start: a processor that stands still before the first tick is reset, too.
    pub(crate) fn new(watchdog: IWDG) -> Self {
        let mut new = Self { watchdog };
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
        self.watchdog.kr().write(|w| unsafe { w.bits(key as _) });
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
        freeze_in_debug(!driving);
        self.key(KEY_RELOAD);
    }
}
