//! USART 3 on PD8 and PD9, for the link.

use stm32h7::stm32h743v::USART3;

use super::gpio::{self, Pin, Pull};
use crate::board::stm32::serial::BAUD;

/// Its kernel clock: that of APB 1 (D2CCIP2R, USART234578SEL = 000 as after reset; RM0433, 8.7.21).
const CLOCK_HZ: u32 = 120_000_000;
/// USART_BRR with oversampling by 16 is the divider itself (RM0433, 48.8): 130, for 0.16 % more than is asked for.
const DIVIDER: u32 = (CLOCK_HZ + BAUD / 2) / BAUD;
/// USART_CR3: requests to DMA for both directions (DMAR, DMAT).
const BY_DMA: u32 = 1 << 7 | 1 << 6;
/// USART_CR1: transmitter, receiver, on (TE, RE, UE).
const BOTH_WAYS: u32 = 1 << 3 | 1 << 2 | 1;
/// USART_ICR: parity, framing, noise, overrun (PECF, FECF, NECF, ORECF), and a finished transmission (TCCF).
const ERRORS: u32 = 0b1111;
const SENT: u32 = 1 << 6;

/// The port.
pub(crate) struct Usart(USART3);

impl Usart {
    /// Starts it, clocked and reset, with requests to DMA.
    pub(super) fn new(usart: USART3) -> Self {
        Pin::<{ gpio::D }, 8>::alternate(7, Pull::None);
        // Without the probe's chip the line would be read as noise.
        Pin::<{ gpio::D }, 9>::alternate(7, Pull::Up);
        // SAFETY: values of the manual, as the constants say.
        unsafe {
            usart.brr().write(|w| w.bits(DIVIDER));
            usart.cr3().write(|w| w.bits(BY_DMA));
            usart.cr1().write(|w| w.bits(BOTH_WAYS));
        }
        Self(usart)
    }

    /// Addresses of the data registers, to send and to receive.
    pub(crate) fn data_addresses(&self) -> (u32, u32) {
        (self.0.tdr().as_ptr() as u32, self.0.rdr().as_ptr() as u32)
    }

    /// Clears the flags of a noisy or broken line.
    pub(crate) fn forget_errors(&self) {
        // SAFETY: ones clear these flags, zeros leave the others alone.
        self.0.icr().write(|w| unsafe { w.bits(ERRORS) });
    }

    /// Makes [`Usart::has_sent`] false until the bytes that follow are out.
    pub(crate) fn forget_sent(&self) {
        // SAFETY: as above.
        self.0.icr().write(|w| unsafe { w.bits(SENT) });
    }

    /// True if the last bit has left.
    pub(crate) fn has_sent(&self) -> bool {
        self.0.isr().read().bits() & SENT != 0
    }
}
