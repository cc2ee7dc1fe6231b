//! USART 2 on PA2 and PA3, for the link.

use stm32f4xx_hal::gpio::{PA2, PA3, Pull};
use stm32f4xx_hal::pac::USART2;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::board::stm32::serial::BAUD;

/// USART_SR: all bits that a zero clears, but for that of a finished transmission.
const CLEAR_SENT: u16 = !(1 << 6);

/// The port.
pub(crate) struct Usart(USART2);

impl Usart {
    /// Starts it, with requests to DMA. With 45 MHz divided by 49 the rate is 0.35 % less.
    pub(super) fn new(usart: USART2, pins: (PA2, PA3), rcc: &mut Rcc) -> Self {
        let _ = pins.0.into_alternate::<7>();
        // Without the probe's chip the line would be read as noise.
        let _ = pins.1.into_alternate::<7>().internal_resistor(Pull::Up);
        USART2::enable(rcc);
        USART2::reset(rcc);
        // Oversampling by 16: USART_BRR is the divider itself (RM0390, 25.4.4).
        let divider = (rcc.clocks.pclk1().raw() + BAUD / 2) / BAUD;
        // SAFETY: mantissa and fraction together are the divider.
        usart.brr().write(|w| unsafe { w.bits(divider as u16) });
        usart.cr3().write(|w| w.dmar().set_bit().dmat().set_bit());
        usart
            .cr1()
            .write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
        Self(usart)
    }

    /// Addresses of the data registers, to send and to receive.
    pub(crate) fn data_addresses(&self) -> (u32, u32) {
        let data_register = self.0.dr().as_ptr() as u32;
        (data_register, data_register)
    }

    /// Clears the flags of a noisy or broken line: reading the status does, and the stream reading the data after it.
    pub(crate) fn forget_errors(&self) {
        let _ = self.0.sr().read();
    }

    /// Makes [`Usart::has_sent`] false until the bytes that follow are out.
    pub(crate) fn forget_sent(&self) {
        // SAFETY: ones leave a flag of this register as it is.
        self.0.sr().write(|w| unsafe { w.bits(CLEAR_SENT) });
    }

    /// True if the last bit has left.
    pub(crate) fn has_sent(&self) -> bool {
        self.0.sr().read().tc().bit_is_set()
    }
}
