//! SPI 2 as the converter's bus has it: mode 1, a byte for each that is written.

use stm32f4xx_hal::pac::SPI2;

use crate::board::stm32::converter_bus::wait_at_last;

/// SPI_CR1 (RM0390, 26.7.1): clock phase 1 (CPHA), master (MSTR), on (SPE), and slave select by software (SSI, SSM).
const SPI_CR1: u16 = 1 | 1 << 2 | 1 << 6 | 1 << 8 | 1 << 9;

/// SPI_CR1, bits BR: the peripheral clock divided.
#[derive(Clone, Copy)]
#[repr(u16)]
pub(crate) enum Rate {
    /// By 2.
    Write = 0b000 << 3,
    /// By 8.
    Read = 0b010 << 3,
}

/// The SPI, clocked and reset.
pub(crate) struct Spi(pub(super) SPI2);

impl Spi {
    /// Lets a stream take what is received.
    pub(super) fn new(spi: SPI2) -> Self {
        spi.cr2().write(|w| w.rxdmaen().set_bit());
        Self(spi)
    }

    /// Addresses of the data registers, to send and to receive.
    pub(crate) fn data_addresses(&self) -> (u32, u32) {
        let data_register = self.0.dr8().as_ptr() as u32;
        (data_register, data_register)
    }

    /// Gets ready for some bytes at a rate.
    #[inline(always)]
    pub(crate) fn start(&mut self, rate: Rate, _bytes: u32) {
        // SAFETY: values of the manual, as the constants say.
        self.0
            .cr1()
            .write(|w| unsafe { w.bits(SPI_CR1 | rate as u16) });
    }

    /// Takes out a byte that came too late: it must not be taken for the next one's. Reading both also clears an overrun.
    pub(crate) fn discard(&mut self) {
        let _ = self.0.dr8().read();
        let _ = self.0.sr().read();
    }

    /// Ends what is under way, from any context.
    pub(crate) fn end_at_last() {
        // SAFETY: reading the status changes nothing that its owner, who does not run again, would care for.
        let spi = unsafe { SPI2::steal() };
        wait_at_last(|| !spi.sr().read().bsy().bit_is_set());
    }

    /// Sends bytes, and waits until they are out, from any context.
    pub(crate) fn send_at_last(bytes: [u8; 3]) {
        // SAFETY: its owner does not run again.
        let spi = unsafe { SPI2::steal() };
        for byte in bytes {
            wait_at_last(|| spi.sr().read().txe().bit_is_set());
            spi.dr8().write(|w| w.dr().set(byte));
        }
        wait_at_last(|| spi.sr().read().txe().bit_is_set());
        wait_at_last(|| !spi.sr().read().bsy().bit_is_set());
    }
}
