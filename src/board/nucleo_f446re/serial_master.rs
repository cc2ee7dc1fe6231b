//! The SPI of a serial encoder, SPI 3: a write to SPI3_CR2, by which it asks its own two streams for bytes, starts a frame.

use core::sync::atomic::{Ordering, fence};

use quadrant::drivers::serial_encoder::MAX_FRAME_BYTES;
use stm32f4xx_hal::gpio::{Debugger, PB3, PB4, Pull, Speed};
use stm32f4xx_hal::pac::{DMA1, SPI3};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::board::stm32::dma_memory::DmaMemory;

/// SPI_CR1 (RM0390, 26.7.1): clock high at rest (CPOL), sampled at its rising edges (CPHA), master (MSTR), on (SPE), and slave select
/// by software (SSI, SSM).
const SPI_CR1: u16 = 0b11 | 1 << 2 | 1 << 6 | 1 << 8 | 1 << 9;
/// SPI_CR1, BR: the clock's divider.
const DIVIDER: u32 = 3;
/// SPI_CR2: DMA for both ways (RXDMAEN, TXDMAEN).
const BOTH_BY_DMA: u32 = 0b11;

/// Streams of DMA 1 (RM0390, table 28): SPI3_RX is stream 0 and SPI3_TX is stream 7, both on channel 0.
const RECEIVER: usize = 0;
const SENDER: usize = 7;
/// DMA_SxCR (RM0390, 9.5.5): priority (PL), memory incremented (MINC), from memory (DIR); bytes.
const RECEIVER_CR: u32 = 0b11 << 16 | 1 << 10;
const SENDER_CR: u32 = 0b10 << 16 | 0b01 << 6;
/// DMA_SxCR, EN.
const ON: u32 = 1;
/// DMA_LIFCR and DMA_HIFCR: all five flags of stream 0, and of stream 7.
const CLEAR_RECEIVER: u32 = 0b11_1101;
const CLEAR_SENDER: u32 = 0b11_1101 << 22;

/// The byte that is sent: nothing is connected there.
static SENT: DmaMemory<u8, 1> = DmaMemory::new([0]);
/// The frame; bytes behind it stay zero.
static FRAME: DmaMemory<u8, MAX_FRAME_BYTES> = DmaMemory::new([0; MAX_FRAME_BYTES]);

/// The SPI and its pins, not used yet.
pub(crate) struct SerialParts {
    spi: SPI3,
    /// MA, as after reset.
    clock: PB3<Debugger>,
    /// SLO, as after reset.
    data: PB4<Debugger>,
}

impl SerialParts {
    /// Clocks and resets the SPI, and leaves the pins as they are.
    pub(super) fn new(
        spi: SPI3,
        (clock, data): (PB3<Debugger>, PB4<Debugger>),
        rcc: &mut Rcc,
    ) -> Self {
        SPI3::enable(rcc);
        SPI3::reset(rcc);
        Self { spi, clock, data }
    }
}

/// The SPI as the encoder's master.
pub(crate) struct SerialMaster {
    spi: SPI3,
    bytes: u32,
}

/// The controller of the streams.
fn dma() -> DMA1 {
    // SAFETY: the link's port owns this controller for streams 5 and 6, the converter's bus uses stream 3, and the encoder's input
    // stream 1; here only streams 0 and 7 are used, and registers of flags that ones clear and zeros leave alone.
    unsafe { DMA1::steal() }
}

impl SerialMaster {
    /// DMA_SxCR of the stream that starts a frame: TIM6_UP on channel 7 (RM0390, table 28), half-words (MSIZE, PSIZE).
    pub(crate) const KICK_STREAM: u32 = 7 << 25 | 1 << 13 | 1 << 11;
    /// The value that it writes.
    pub(crate) const KICK: u32 = BOTH_BY_DMA;

    /// A master of frames of some bytes, with a divider ([`rate`](quadrant::drivers::serial_encoder::times::SpiTimes::rate)).
    pub(crate) fn new(parts: SerialParts, rate: u32, bytes: u32) -> Self {
        let SerialParts { spi, clock, data } = parts;
        // SAFETY: the value is the manual's, as the constants say.
        spi.cr1()
            .write(|w| unsafe { w.bits(SPI_CR1 | (rate << DIVIDER) as u16) });
        let _ = clock.into_alternate::<6>().speed(Speed::VeryHigh);
        // A line that is not driven rests high.
        let _ = data.into_alternate::<6>().internal_resistor(Pull::Up);
        let data_register = spi.dr8().as_ptr() as u32;
        let dma = dma();
        for (stream, memory, configuration) in [
            (RECEIVER, FRAME.address(), RECEIVER_CR),
            (SENDER, SENT.address(), SENDER_CR),
        ] {
            let stream = dma.st(stream);
            // SAFETY: the addresses are those of a register and of static memory; the configuration is the manual's.
            unsafe {
                stream.par().write(|w| w.pa().bits(data_register));
                stream.m0ar().write(|w| w.m0a().bits(memory));
                stream.cr().write(|w| w.bits(configuration));
            }
        }
        Self { spi, bytes }
    }

    /// Address of the register whose write starts a frame.
    pub(crate) fn kicked(&self) -> u32 {
        self.spi.cr2().as_ptr() as u32
    }

    /// The frame, if it is complete. No further one starts until this is armed.
    #[inline(always)]
    pub(crate) fn receive(&mut self) -> Option<u64> {
        let received = if dma().st(RECEIVER).ndtr().read().bits() == 0 {
            // The frame is read after the counter.
            fence(Ordering::Acquire);
            let shift = |word: u64, index| word << 8 | u64::from(FRAME.read(index));
            Some((0..MAX_FRAME_BYTES).fold(0, shift))
        } else {
            None
        };
        // SAFETY: no more requests until the timer's next end.
        self.spi.cr2().write(|w| unsafe { w.bits(0) });
        received
    }

    /// Ends a frame that is not complete.
    #[inline(always)]
    pub(crate) fn stop(&mut self) {
        let dma = dma();
        // SAFETY: the configuration is that of `new`.
        unsafe {
            dma.st(RECEIVER).cr().write(|w| w.bits(RECEIVER_CR));
            dma.st(SENDER).cr().write(|w| w.bits(SENDER_CR));
        }
    }

    /// Arms the streams, which rest, for a frame.
    #[inline(always)]
    pub(crate) fn arm(&mut self) {
        // A request that a late start left must not start this frame before its time.
        // SAFETY: no more requests until the timer's next end.
        self.spi.cr2().write(|w| unsafe { w.bits(0) });
        // A byte that came too late must not be taken for the next one's; reading both also clears an overrun.
        let _ = self.spi.dr8().read();
        let _ = self.spi.sr().read();
        let dma = dma();
        fence(Ordering::Release);
        // SAFETY: ones clear the flags of these streams; the configuration is that of `new`, and only this switches them on.
        unsafe {
            dma.lifcr().write(|w| w.bits(CLEAR_RECEIVER));
            dma.hifcr().write(|w| w.bits(CLEAR_SENDER));
            for (stream, configuration) in [(RECEIVER, RECEIVER_CR), (SENDER, SENDER_CR)] {
                dma.st(stream).ndtr().write(|w| w.bits(self.bytes));
                dma.st(stream).cr().write(|w| w.bits(configuration | ON));
            }
        }
    }
}
