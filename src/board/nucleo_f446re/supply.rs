//! The processor's supply, and why it was reset.

use quadrant::hal::ResetCause;
use stm32f4xx_hal::pac::{FLASH, PWR, RCC};

use super::wiring::RESETS;

/// Reads why the processor was reset, and clears the flags for the next time.
pub(super) fn reset_cause(rcc: &RCC) -> ResetCause {
    let cause = RESETS.cause(rcc.csr().read().bits());
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    cause
}

/// The processor's supply.
pub(crate) struct Supply {
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
    pub(crate) fn is_low(&self) -> bool {
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
