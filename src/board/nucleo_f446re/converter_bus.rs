//! The converter's bus: SPI 2 in mode 1, /SYNC and /LDAC, all three moved by timer 1 and DMA.
//!
//! In every step of timer 1 (`quadrant::drivers::ad5754r::steps`) its first channel makes DMA 2 write a word to port B, its
//! second one a byte to the SPI; DMA 1 takes the byte that comes back. The timer's repetition counter counts the steps, and
//! its one-pulse mode stops it behind the last one. The processor fills the table of bytes, arms the streams and starts
//! the timer.

use core::sync::atomic::{Ordering, fence};

use quadrant::drivers::ad5754r::Sequencer;
use quadrant::drivers::ad5754r::steps::{
    BYTE_AT, FRAME_STEPS, FRAMES_AT, MAX_STEPS, PIN_CHANGES, PINS_AT, PinChange,
};
use stm32f4xx_hal::gpio::{Output, PB1, PB12, PB13, PB14, PB15, PinState, Pull, Speed};
use stm32f4xx_hal::pac::{DMA1, DMA2, GPIOB, SPI2, TIM1};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use super::CORE_HZ;
use super::bus_times::{READING, TIMER_HZ, WRITING};
use super::dma_memory::DmaMemory;
use super::pins::{LOAD, SYNC};

const _: () = assert!(TIMER_HZ == CORE_HZ);

/// SPI_CR1 (RM0390, 26.7.1): clock phase 1 (CPHA), master (MSTR), on (SPE), and slave select by software (SSI, SSM).
const SPI_CR1: u16 = 1 | 1 << 2 | 1 << 6 | 1 << 8 | 1 << 9;
/// SPI_CR1, bits BR: the peripheral clock divided by 2 and by 8.
const BY_2: u16 = 0b000 << 3;
const BY_8: u16 = 0b010 << 3;

/// TIM1_CR1 (RM0390, 16.4.1): only the counter's end is an update (URS), which stops it (OPM); with and without its start (CEN).
const TIMER_STOPPED: u32 = 1 << 2 | 1 << 3;
const TIMER_STARTED: u32 = TIMER_STOPPED | 1;

/// Streams of DMA 2 (RM0390, table 29): TIM1_CH1 is stream 1, TIM1_CH2 is stream 2, both on channel 6.
const PINS: usize = 1;
const BYTES: usize = 2;
/// Stream of DMA 1 (RM0390, table 28): SPI2_RX is stream 3, on channel 0.
const RECEIVER: usize = 3;
/// DMA_SxCR (RM0390, 9.5.5): channel (CHSEL), priority (PL), sizes in memory and at the peripheral (MSIZE, PSIZE: 0 a byte, 2 a
/// word), memory incremented (MINC), from memory (DIR).
const PINS_CR: u32 = 6 << 25 | 0b11 << 16 | 2 << 13 | 2 << 11 | 1 << 10 | 0b01 << 6;
const BYTES_CR: u32 = 6 << 25 | 0b10 << 16 | 1 << 10 | 0b01 << 6;
const RECEIVER_CR: u32 = 0b11 << 16 | 1 << 10;
/// DMA_SxCR, EN.
const ON: u32 = 1;
/// DMA_LIFCR: all five flags of streams 1 and 2, and of stream 3.
const CLEAR_PINS_AND_BYTES: u32 = 0b11_1101 << 6 | 0b11_1101 << 16;
const CLEAR_RECEIVER: u32 = 0b11_1101 << 22;

/// Largest number of polls of what was started before giving up: the longest takes some 2100 cycles, a look nine at least.
const PATIENCE: u32 = 300;

/// Words for the set/reset register of port B, in RAM: flash cannot be read while it is erased.
static PIN_WORDS: DmaMemory<u32, MAX_STEPS> = DmaMemory::new([0; MAX_STEPS]);
/// Bytes to send, zero where the chip does not receive them.
static TO_SEND: DmaMemory<u8, MAX_STEPS> = DmaMemory::new([0; MAX_STEPS]);
static RECEIVED: DmaMemory<u8, MAX_STEPS> = DmaMemory::new([0; MAX_STEPS]);

/// The bus did not do its work in time: it is not clocked, or was switched off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stuck;

/// The pins of the bus, as they are after reset.
pub(super) struct Pins {
    pub(super) clock: PB13,
    pub(super) answer: PB14,
    pub(super) data: PB15,
    pub(super) sync: PB12,
    pub(super) load: PB1,
}

/// The converter's bus.
pub(super) struct ConverterBus {
    spi: SPI2,
    timer: TIM1,
    dma: DMA2,
    sync: PB12<Output>,
    load: PB1<Output>,
}

/// The controller of the receiving stream.
fn receiver_dma() -> DMA1 {
    // SAFETY: the link's port owns this controller for streams 5 and 6; here only stream 3 is used, and a register of flags
    // that ones clear and zeros leave alone.
    unsafe { DMA1::steal() }
}

impl ConverterBus {
    /// Starts the bus, with both pins high. DMA 1 is clocked.
    pub(super) fn new(spi: SPI2, timer: TIM1, dma: DMA2, pins: Pins, rcc: &mut Rcc) -> Self {
        // High from the first moment: an output that is set afterwards is low for 40 ns, which the converter takes for a frame.
        let high = PinState::High;
        let sync = pins
            .sync
            .into_push_pull_output_in_state(high)
            .speed(Speed::VeryHigh);
        let load = pins
            .load
            .into_push_pull_output_in_state(high)
            .speed(Speed::VeryHigh);
        let _ = pins.clock.into_alternate::<5>().speed(Speed::VeryHigh);
        let _ = pins.data.into_alternate::<5>().speed(Speed::VeryHigh);
        // A converter that is not there answers with ones.
        let _ = pins
            .answer
            .into_alternate::<5>()
            .internal_resistor(Pull::Up);
        SPI2::enable(rcc);
        SPI2::reset(rcc);
        TIM1::enable(rcc);
        TIM1::reset(rcc);
        DMA2::enable(rcc);
        DMA2::reset(rcc);
        spi.cr2().write(|w| w.rxdmaen().set_bit());
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

        // SAFETY: only the register's address is taken.
        let port = unsafe { GPIOB::steal() }.bsrr().as_ptr() as u32;
        let data_register = spi.dr8().as_ptr() as u32;
        let receiver = receiver_dma();
        for (stream, peripheral, memory, configuration) in [
            (dma.st(PINS), port, PIN_WORDS.address(), PINS_CR),
            (dma.st(BYTES), data_register, TO_SEND.address(), BYTES_CR),
            (
                receiver.st(RECEIVER),
                data_register,
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
    fn start(&mut self, steps: usize, step_cycles: u32, rate: u16) {
        let receiver = receiver_dma();
        // What was filled in is there before the streams look for it.
        fence(Ordering::Release);
        // SAFETY: ones clear the flags of these streams; the rest are values of the manual, as the constants say. The streams'
        // configuration is that of `new`, and only this switches them on.
        unsafe {
            self.spi.cr1().write(|w| w.bits(SPI_CR1 | rate));
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
        // A byte that came too late must not be taken for the next one's; reading both also clears an overrun.
        let _ = self.spi.dr8().read();
        let _ = self.spi.sr().read();
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
        self.start(MAX_STEPS, const { WRITING.step_cycles() }, BY_2);
    }

    #[inline(always)]
    fn start_reading(&mut self, frame: [u8; 3]) {
        TO_SEND.write(0, frame);
        self.start(FRAME_STEPS, const { READING.step_cycles() }, BY_8);
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

/// The set/reset register's word for a change (RM0390, 7.4.7): the lower half sets pins, the upper half resets them.
const fn word(change: PinChange) -> u32 {
    match change {
        PinChange::Keep => 0,
        PinChange::Select => 1 << (16 + SYNC),
        PinChange::Release => 1 << SYNC,
        PinChange::Load => 1 << (16 + LOAD),
        PinChange::EndLoad => 1 << LOAD,
    }
}
