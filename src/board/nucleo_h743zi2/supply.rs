//! The processor's supply, and why it was reset.

use quadrant::hal::ResetCause;
use stm32h7::stm32h743v::{FLASH, PWR, RCC};

use super::wiring::RESETS;

/// Reads why the processor was reset, and clears the flags for the next time (RCC_RSR, RMVF).
pub(super) fn reset_cause(rcc: &RCC) -> ResetCause {
    const FORGET: u32 = 1 << 16;
    let cause = RESETS.cause(rcc.rsr().read().bits());
    // SAFETY: bits of the manual; the flags themselves are read-only.
    unsafe {
        rcc.rsr().modify(|r, w| w.bits(r.bits() | FORGET));
        rcc.rsr().modify(|r, w| w.bits(r.bits() & !FORGET));
    }
    cause
}

/// The processor's supply.
pub(crate) struct Supply {
    power: PWR,
}

impl Supply {
    /// Starts to watch the supply.
    ///
    /// PWR_CR1 (RM0433, 6.8.1): the highest threshold of its own (PLS = 110), detector on (PVDE): typically 2.76 V falling and
    /// 2.86 V rising (DS12110, table 116).
    pub(super) fn new(power: PWR) -> Self {
        const WATCH: u32 = 0b110 << 5 | 1 << 4;
        // SAFETY: values of the manual.
        power
            .cr1()
            .modify(|r, w| unsafe { w.bits(r.bits() & !(0b111 << 5) | WATCH) });
        Self { power }
    }

    /// True if the supply is below that at present (PWR_CSR1, PVDO; 6.8.2).
    #[inline(always)]
    pub(crate) fn is_low(&self) -> bool {
        self.power.csr1().read().bits() & 1 << 4 != 0
    }
}

/// The threshold below which the supply resets the processor, in words, if it does: an option of the chip, kept in its
/// flash (FLASH_OPTSR_CUR, BOR_LEV; RM0433, 4.9.8).
pub(super) fn brown_out_level(flash: &FLASH) -> Option<&'static str> {
    match flash.optsr_cur().read().bits() >> 2 & 0b11 {
        0b11 => Some("level 3, 2.7 V"),
        0b10 => Some("level 2, 2.4 V"),
        0b01 => Some("level 1, 2.1 V"),
        _ => None,
    }
}
