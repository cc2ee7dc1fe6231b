//! SPI 1 as the converter's bus has it: mode 1, a byte for each that is written.

use stm32h7::stm32h743v::SPI1;

use crate::board::stm32::converter_bus::wait_at_last;

/// SPI_CR1 (RM0433, 50.11.1): the pin for slave select is not used, and high inside (SSI); on (SPE); transfer started (CSTART).
const SELECTED: u32 = 1 << 12;
const ON: u32 = SELECTED | 1;
const STARTED: u32 = ON | 1 << 9;
/// SPI_CFG1 (50.11.3): bytes (DSIZE = 7), one in a packet (FTHLV = 0), CRC off but 8 bits long (CRCSIZE = 7; ES0392, 2.22.5), a
/// stream takes what is received (RXDMAEN).
const BYTES: u32 = 7 << 16 | 1 << 14 | 7;
/// SPI_CFG2 (50.11.4): pins driven while it is off (AFCNTR), slave select by software (SSM), clock phase 1 (CPHA), master (MASTER).
const MODE_1: u32 = 1 << 31 | 1 << 26 | 1 << 24 | 1 << 22;
/// SPI_IFCR (50.11.7): all flags.
const ALL_FLAGS: u32 = 0b1111_1111_1000;

/// SPI_CFG1, MBR: the kernel clock divided.
#[derive(Clone, Copy)]
#[repr(u32)]
pub(crate) enum Rate {
    /// By 2.
    Write = 0b000 << 28,
    /// By 8.
    Read = 0b010 << 28,
}

/// The SPI, clocked and reset.
pub(crate) struct Spi(SPI1);

impl Spi {
    /// Off, with its pins driven.
    pub(super) fn new(spi: SPI1) -> Self {
        // SAFETY: values of the manual, as the constants say.
        unsafe {
            spi.cr1().write(|w| w.bits(SELECTED));
            spi.cfg2().write(|w| w.bits(MODE_1));
        }
        Self(spi)
    }

    /// Addresses of the data registers, to send and to receive.
    pub(crate) fn data_addresses(&self) -> (u32, u32) {
        (
            self.0.txdr8().as_ptr() as u32,
            self.0.rxdr8().as_ptr() as u32,
        )
    }

    /// Gets ready for some bytes at a rate. While it is off both queues are emptied, and only then rate and number are taken.
    #[inline(always)]
    pub(crate) fn start(&mut self, rate: Rate, bytes: u32) {
        begin(&self.0, rate, bytes);
    }

    /// Ends a transfer that did not come to its end, and forgets what was received.
    pub(crate) fn discard(&mut self) {
        // SAFETY: a value of the manual.
        unsafe { self.0.cr1().write(|w| w.bits(SELECTED)) };
    }

    /// Ends what is under way, from any context.
    pub(crate) fn end_at_last() {
        // SAFETY: its owner does not run again; a single write.
        unsafe { SPI1::steal().cr1().write(|w| w.bits(SELECTED)) };
    }

    /// Sends bytes, and waits until they are out, from any context.
    pub(crate) fn send_at_last(bytes: [u8; 3]) {
        // SAFETY: its owner does not run again.
        let spi = unsafe { SPI1::steal() };
        begin(&spi, Rate::Write, bytes.len() as u32);
        for byte in bytes {
            // SAFETY: any byte.
            spi.txdr8().write(|w| unsafe { w.bits(byte) });
        }
        wait_at_last(|| spi.sr().read().eot().bit_is_set());
    }
}

/// Starts a transfer.
#[inline(always)]
fn begin(spi: &SPI1, rate: Rate, bytes: u32) {
    // SAFETY: values of the manual, as the constants say.
    unsafe {
        spi.cr1().write(|w| w.bits(SELECTED));
        spi.ifcr().write(|w| w.bits(ALL_FLAGS));
        spi.cfg1().write(|w| w.bits(BYTES | rate as u32));
        spi.cr2().write(|w| w.bits(bytes));
        spi.cr1().write(|w| w.bits(ON));
        spi.cr1().write(|w| w.bits(STARTED));
    }
}
