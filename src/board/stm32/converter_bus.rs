//! The converter's bus: an SPI in mode 1, /SYNC and /LDAC, all three moved by an advanced timer and DMA.
//!
//! In every step of the timer (`quadrant::drivers::ad5754r::steps`) its first channel makes DMA 2 write a word to the port of
//! /SYNC and /LDAC, its second one a byte to the SPI; DMA 1 takes the byte that comes back. The timer's repetition counter counts the steps, and
//! its one-pulse mode stops it behind the last one. The processor fills the table of bytes, arms the streams and starts
//! the timer.

use core::sync::atomic::{Ordering, fence};

use embedded_hal::delay::DelayNs;
use quadrant::drivers::ad5754r::Sequencer;
use quadrant::drivers::ad5754r::steps::{
    BYTE_AT, FRAME_STEPS, FRAMES_AT, MAX_STEPS, PIN_CHANGES, PINS_AT, PinChange,
};

use super::dma_memory::DmaMemory;
use crate::board::chip::pac::{DMA1, DMA2};
use crate::board::chip::{
    self, ConverterTimer, LOAD, Load, PATIENCE, READING, Rate, SPI_STREAM, SYNC, Spi, Sync,
    TIMER_STREAM, WRITING,
};

/// TIMx_CR1 (RM0390, 16.4.1; RM0433, 38.4.1): only the counter's end is an update (URS), which stops it (OPM); with and without its start (CEN).
const TIMER_STOPPED: u32 = 1 << 2 | 1 << 3;
const TIMER_STARTED: u32 = TIMER_STOPPED | 1;

/// Streams of DMA 2 for the timer's first and second channel.
pub(crate) const PINS: usize = 1;
pub(crate) const BYTES: usize = 2;
/// Stream of DMA 1 for what the SPI receives.
pub(crate) const RECEIVER: usize = 3;
/// DMA_SxCR (RM0390, 9.5.5; RM0433, 15.5.5): priority (PL), sizes in memory and at the peripheral (MSIZE, PSIZE: 0 a byte, 2 a
/// word), memory incremented (MINC), from memory (DIR); the chip adds what selects the request.
const PINS_CR: u32 = TIMER_STREAM | 0b11 << 16 | 2 << 13 | 2 << 11 | 1 << 10 | 0b01 << 6;
const BYTES_CR: u32 = TIMER_STREAM | 0b10 << 16 | 1 << 10 | 0b01 << 6;
const RECEIVER_CR: u32 = SPI_STREAM | 0b11 << 16 | 1 << 10;
/// DMA_SxCR, EN.
const ON: u32 = 1;
/// DMA_LIFCR: all five flags of streams 1 and 2, and of stream 3.
const CLEAR_PINS_AND_BYTES: u32 = 0b11_1101 << 6 | 0b11_1101 << 16;
const CLEAR_RECEIVER: u32 = 0b11_1101 << 22;

/// Words for the set/reset register of the port of /SYNC and /LDAC.
#[unsafe(link_section = ".bss.dma.pins")]
static PIN_WORDS: DmaMemory<u32, MAX_STEPS> = DmaMemory::new([0; MAX_STEPS]);
/// Bytes to send, zero where the chip does not receive them.
#[unsafe(link_section = ".bss.dma.to_converter")]
static TO_SEND: DmaMemory<u8, MAX_STEPS> = DmaMemory::new([0; MAX_STEPS]);
#[unsafe(link_section = ".bss.dma.from_converter")]
static RECEIVED: DmaMemory<u8, MAX_STEPS> = DmaMemory::new([0; MAX_STEPS]);

/// The bus did not do its work in time: it is not clocked, or was switched off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stuck;

/// The converter's bus.
pub(crate) struct ConverterBus {
    spi: Spi,
    timer: ConverterTimer,
    dma: DMA2,
    sync: Sync,
    load: Load,
}

/// The controller of the receiving stream.
fn receiver_dma() -> DMA1 {
    // SAFETY: the link's port owns this controller for streams 5 and 6; here only stream 3 is used, and a register of flags
    // that ones clear and zeros leave alone.
    unsafe { DMA1::steal() }
}

impl ConverterBus {
    /// Starts the bus. SPI, timer and both controllers are clocked and reset, and both pins are outputs and high.
    pub(crate) fn new(
        spi: Spi,
        timer: ConverterTimer,
        dma: DMA2,
        (sync, load): (Sync, Load),
    ) -> Self {
        PIN_WORDS.write(0, PIN_CHANGES.map(word));

        // SAFETY: counts of the timer, whose step they lie in.
        unsafe {
            timer.cr1().write(|w| w.bits(TIMER_STOPPED));
            timer.ccr1().write(|w| w.bits(PINS_AT));
            timer.ccr2().write(|w| w.bits(BYTE_AT));
        }
        timer
            .dier()
            .write(|w| w.cc1de().enabled().cc2de().enabled());

        let (data_out, data_in) = spi.data_addresses();
        let receiver = receiver_dma();
        for (stream, peripheral, memory, configuration) in [
            (
                dma.st(PINS),
                chip::port_address(),
                PIN_WORDS.address(),
                PINS_CR,
            ),
            (dma.st(BYTES), data_out, TO_SEND.address(), BYTES_CR),
            (
                receiver.st(RECEIVER),
                data_in,
                RECEIVED.address(),
                RECEIVER_CR,
            ),
        ] {
            // SAFETY: the addresses are those of registers and of static memory; the configuration is the manual's.
            unsafe {
                stream.par().write(|w| w.pa().bits(peripheral));
                stream.m0ar().write(|w| w.m0a().bits(memory));
                stream.cr().write(|w| w.bits(configuration));
            }
        }
        Self {
            spi,
            timer,
            dma,
            sync,
            load,
        }
    }

    /// Starts steps of the tables from their beginning. The timer rests, and so do the streams.
    #[inline(always)]
    fn start(&mut self, steps: usize, step_cycles: u32, rate: Rate) {
        let receiver = receiver_dma();
        // What was filled in is there before the streams look for it.
        fence(Ordering::Release);
        self.spi.start(rate, steps as u32);
        // SAFETY: ones clear the flags of these streams; the rest are values of the manual, as the constants say. The streams'
        // configuration is that of `new`, and only this switches them on.
        unsafe {
            self.dma.lifcr().write(|w| w.bits(CLEAR_PINS_AND_BYTES));
            receiver.lifcr().write(|w| w.bits(CLEAR_RECEIVER));
            for (stream, configuration) in [
                (receiver.st(RECEIVER), RECEIVER_CR),
                (self.dma.st(PINS), PINS_CR),
                (self.dma.st(BYTES), BYTES_CR),
            ] {
                stream.ndtr().write(|w| w.bits(steps as u32));
                stream.cr().write(|w| w.bits(configuration | ON));
            }
            self.timer.arr().write(|w| w.bits(step_cycles - 1));
            self.timer.rcr().write(|w| w.bits(steps as u32 - 1));
            // Takes the number of repetitions over.
            self.timer.egr().write(|w| w.ug().set_bit());
            self.timer.cr1().write(|w| w.bits(TIMER_STARTED));
        }
    }

    /// True if all steps were taken, and a byte came back in each.
    #[inline(always)]
    fn has_ended(&self) -> bool {
        !self.timer.cr1().read().cen().is_enabled()
            && receiver_dma().st(RECEIVER).ndtr().read().bits() == 0
    }

    /// Waits for the end of what was started, in a tick that follows the one before at once; stops what does not come to it.
    #[cold]
    #[inline(never)]
    fn wait(&mut self) -> Result<(), Stuck> {
        for _ in 0..PATIENCE {
            if self.has_ended() {
                return Ok(());
            }
        }
        // SAFETY: the configuration is that of `new`.
        unsafe {
            self.timer.cr1().write(|w| w.bits(TIMER_STOPPED));
            self.dma.st(PINS).cr().write(|w| w.bits(PINS_CR));
            self.dma.st(BYTES).cr().write(|w| w.bits(BYTES_CR));
            receiver_dma()
                .st(RECEIVER)
                .cr()
                .write(|w| w.bits(RECEIVER_CR));
        }
        self.sync.set_high();
        self.load.set_high();
        self.spi.discard();
        Err(Stuck)
    }
}

impl Sequencer for ConverterBus {
    type Error = Stuck;

    #[inline(always)]
    fn start_writing(&mut self, frames: [[u8; 3]; 4]) {
        let [first, second, third, fourth] = frames;
        let [at_first, at_second, at_third, at_fourth] = FRAMES_AT;
        TO_SEND.write(at_first, first);
        TO_SEND.write(at_second, second);
        TO_SEND.write(at_third, third);
        TO_SEND.write(at_fourth, fourth);
        self.start(MAX_STEPS, const { WRITING.step_cycles() }, Rate::Write);
    }

    #[inline(always)]
    fn start_reading(&mut self, frame: [u8; 3]) {
        TO_SEND.write(0, frame);
        self.start(FRAME_STEPS, const { READING.step_cycles() }, Rate::Read);
    }

    #[inline(always)]
    fn finish(&mut self) -> Result<[u8; 3], Stuck> {
        if !self.has_ended() {
            self.wait()?;
        }
        // What was received is read after the counter.
        fence(Ordering::Acquire);
        Ok([0, 1, 2].map(|index| RECEIVED.read(index)))
    }
}

/// The set/reset register's word for a change (RM0390, 7.4.7; RM0433, 11.4.7): the lower half sets pins, the upper half resets them.
const fn word(change: PinChange) -> u32 {
    match change {
        PinChange::Keep => 0,
        PinChange::Select => 1 << (16 + SYNC),
        PinChange::Release => 1 << SYNC,
        PinChange::Load => 1 << (16 + LOAD),
        PinChange::EndLoad => 1 << LOAD,
    }
}

/// Sends a frame and pulses /LDAC, by the processor alone, from any context.
pub(crate) fn send_at_last(frame: [u8; 3], delay: &mut impl DelayNs) {
    // SAFETY: the owners of timer and streams do not run again; only single writes are made, each valid in any state they left.
    let (timer, dma) = unsafe { (ConverterTimer::steal(), DMA2::steal()) };
    // End the frame that may be under way; the chip ignores it unless it is complete.
    timer.cr1().reset();
    for stream in [PINS, BYTES] {
        dma.st(stream).cr().reset();
    }
    Spi::end_at_last();
    chip::set_lines(1 << SYNC | 1 << LOAD);
    delay.delay_us(1);
    chip::set_lines(1 << (16 + SYNC));
    Spi::send_at_last(frame);
    chip::set_lines(1 << SYNC);
    delay.delay_us(1);
    chip::set_lines(1 << (16 + LOAD));
    delay.delay_us(1);
    chip::set_lines(1 << LOAD);
}

/// Waits for a peripheral, with a limit: one that was never started does not get ready.
pub(crate) fn wait_at_last(ready: impl Fn() -> bool) {
    /// Far more than one byte takes.
    const LOOKS: u32 = 10_000;
    for _ in 0..LOOKS {
        if ready() {
            return;
        }
    }
}
