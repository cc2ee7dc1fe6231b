//! The SPI of a serial encoder, SPI 2: a write to SPI2_CR1 starts a frame, which its queue holds until the tick.

use quadrant::drivers::serial_encoder::MAX_FRAME_BYTES;
use stm32h7::stm32h743v::SPI2;

use super::gpio::{self, Pin, Pull};

/// SPI_CR1 (RM0433, 50.11.1): the pin for slave select is not used, and high inside (SSI); on (SPE); transfer started (CSTART).
const SELECTED: u32 = 1 << 12;
const ON: u32 = SELECTED | 1;
const STARTED: u32 = ON | 1 << 9;
/// SPI_CFG1 (50.11.3): bytes (DSIZE = 7), one in a packet (FTHLV = 0), CRC off but 8 bits long (CRCSIZE = 7; ES0392, 2.22.5).
const BYTES: u32 = 7 << 16 | 7;
/// SPI_CFG1, MBR: the kernel clock's divider.
const DIVIDER: u32 = 28;
/// SPI_CFG2 (50.11.4): pins driven while it is off (AFCNTR), slave select by software (SSM), clock high at rest (CPOL), sampled at its
/// rising edges (CPHA), master (MASTER), it only receives (COMM = 10), and at the pin for MOSI (IOSWP): that for MISO is taken.
const RECEIVES: u32 = 1 << 31 | 1 << 26 | 1 << 25 | 1 << 24 | 1 << 22 | 0b10 << 17 | 1 << 15;
/// SPI_IFCR (50.11.7): all flags.
const ALL_FLAGS: u32 = 0b1111_1111_1000;

/// The SPI, clocked and reset, not used yet. Its pins are as they are after reset.
pub(crate) struct SerialParts(pub(super) SPI2);

/// The SPI as the encoder's master.
pub(crate) struct SerialMaster {
    spi: SPI2,
    bytes: u32,
}

impl SerialMaster {
    /// DMA_SxCR of the stream that starts a frame (RM0433, 15.5.5): words (MSIZE, PSIZE). DMAMUX 1 selects its request.
    pub(crate) const KICK_STREAM: u32 = 2 << 13 | 2 << 11;
    /// The value that it writes.
    pub(crate) const KICK: u32 = STARTED;

    /// A master of frames of some bytes, with a divider ([`rate`](quadrant::drivers::serial_encoder::times::SpiTimes::rate)).
    pub(crate) fn new(SerialParts(spi): SerialParts, rate: u32, bytes: u32) -> Self {
        // SAFETY: values of the manual, as the constants say.
        unsafe {
            spi.cr1().write(|w| w.bits(SELECTED));
            spi.cfg1().write(|w| w.bits(BYTES | rate << DIVIDER));
            spi.cfg2().write(|w| w.bits(RECEIVES));
            spi.cr2().write(|w| w.bits(bytes));
        }
        // Alternate functions: DS12110, table of port B.
        Pin::<{ gpio::B }, 10>::fast_alternate(5);
        // A line that is not driven rests high.
        Pin::<{ gpio::B }, 15>::alternate(5, Pull::Up);
        Self { spi, bytes }
    }

    /// Address of the register whose write starts a frame.
    pub(crate) fn kicked(&self) -> u32 {
        self.spi.cr1().as_ptr() as u32
    }

    /// The frame, if it is complete.
    #[inline(always)]
    pub(crate) fn receive(&mut self) -> Option<u64> {
        if self.spi.sr().read().eot().bit_is_clear() {
            return None;
        }
        let mut frame = 0;
        for place in 0..MAX_FRAME_BYTES as u32 {
            let byte = if place < self.bytes {
                self.spi.rxdr8().read().bits()
            } else {
                0
            };
            frame = frame << 8 | u64::from(byte);
        }
        Some(frame)
    }

    /// Ends a frame that is not complete, and empties the queue.
    #[inline(always)]
    pub(crate) fn stop(&mut self) {
        // SAFETY: a value of the manual.
        unsafe { self.spi.cr1().write(|w| w.bits(SELECTED)) };
    }

    /// Gets ready for a frame. Off and on: "setting CSTART soon after the end of a transfer can stall the next one" (ES0392).
    #[inline(always)]
    pub(crate) fn arm(&mut self) {
        self.stop();
        // SAFETY: values of the manual, as the constants say.
        unsafe {
            self.spi.ifcr().write(|w| w.bits(ALL_FLAGS));
            self.spi.cr1().write(|w| w.bits(ON));
        }
    }
}
