//! A serial encoder of x in the place of A, B and index: SPI 3 in mode 3, clocked by itself once a tick.
//!
//! Timer 6 has the control tick's period and ends so long before each tick that the frame has just come ([`serial_times`]). At its end
//! DMA 1 writes SPI3_CR2, by which the SPI asks its own two streams for bytes. The tick finds the frame in memory and arms the streams
//! for the next one. So the position is always that of the same time before the tick, whatever the processor does.
//!
//! [`serial_times`]: super::serial_times

use core::sync::atomic::{AtomicU32, Ordering, fence};

use cortex_m::peripheral::DWT;
use quadrant::drivers::serial_encoder::{FrameCounts, MAX_FRAME_BYTES, SerialEncoder};
use quadrant_law::encoder::EncoderReading;
use quadrant_settings::{EncoderSettings, SerialSettings};
use stm32f4xx_hal::gpio::{Debugger, PB3, PB4, Pull, Speed};
use stm32f4xx_hal::pac::{DMA1, SPI3, TIM6, TIM7};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use super::chip::CORE_HZ;
use super::serial_times::{TIMER_HZ, lead_cycles, rate};
use crate::board::stm32::dma_memory::DmaMemory;

/// SPI_CR1 (RM0390, 26.7.1): clock high at rest (CPOL), sampled at its rising edges (CPHA), master (MSTR), on (SPE), and slave select
/// by software (SSI, SSM).
const SPI_CR1: u16 = 0b11 | 1 << 2 | 1 << 6 | 1 << 8 | 1 << 9;
/// SPI_CR2: DMA for both ways (RXDMAEN, TXDMAEN).
const BOTH_BY_DMA: u16 = 0b11;
/// TIMx_CR1: counter enabled (CEN).
const ENABLE: u32 = 1;
/// TIMx_DIER: an update requests DMA (UDE).
const UPDATE_DMA: u32 = 1 << 8;

/// Streams of DMA 1 (RM0390, table 28): SPI3_RX is stream 0 and SPI3_TX is stream 7, both on channel 0; TIM6_UP is stream 1 on
/// channel 7.
const RECEIVER: usize = 0;
const KICK: usize = 1;
const SENDER: usize = 7;
/// DMA_SxCR (RM0390, 9.5.5): channel (CHSEL), priority (PL), sizes in memory and at the peripheral (MSIZE, PSIZE: 0 a byte, 1 a
/// half-word), memory incremented (MINC), again and again (CIRC), from memory (DIR).
const RECEIVER_CR: u32 = 0b11 << 16 | 1 << 10;
const KICK_CR: u32 = 7 << 25 | 0b10 << 16 | 1 << 13 | 1 << 11 | 1 << 8 | 0b01 << 6;
const SENDER_CR: u32 = 0b10 << 16 | 0b01 << 6;
/// DMA_SxCR, EN.
const ON: u32 = 1;
/// DMA_LIFCR and DMA_HIFCR: all five flags of stream 0, and of stream 7.
const CLEAR_RECEIVER: u32 = 0b11_1101;
const CLEAR_SENDER: u32 = 0b11_1101 << 22;

/// The value for SPI3_CR2.
static KICKED: DmaMemory<u16, 1> = DmaMemory::new([BOTH_BY_DMA]);
/// The byte that is sent: nothing is connected there.
static SENT: DmaMemory<u8, 1> = DmaMemory::new([0]);
/// The frame; bytes behind it stay zero.
static FRAME: DmaMemory<u8, MAX_FRAME_BYTES> = DmaMemory::new([0; MAX_FRAME_BYTES]);

/// Frames that were not whole or warned, in the order of [`FrameCounts`], for the log.
static COUNTS: [AtomicU32; 7] = [const { AtomicU32::new(0) }; 7];

/// The pins as they are after reset: clock (MA) and data (SLO).
type Pins = (PB3<Debugger>, PB4<Debugger>);

/// The parts of the input.
struct Parts {
    spi: SPI3,
    timer: TIM6,
    clock: PB3<Debugger>,
    data: PB4<Debugger>,
}

/// The input of a serial encoder. Until one is set, the pins are left as they are.
pub(crate) struct SerialInput {
    parts: Option<Parts>,
    running: Option<Running>,
}

impl SerialInput {
    /// The board has such an input.
    pub(crate) const IS_THERE: bool = true;

    /// An input that is not used yet. DMA 1 is clocked.
    pub(super) fn new(spi: SPI3, timer: TIM6, (clock, data): Pins, rcc: &mut Rcc) -> Self {
        SPI3::enable(rcc);
        SPI3::reset(rcc);
        TIM6::enable(rcc);
        TIM6::reset(rcc);
        Self {
            parts: Some(Parts {
                spi,
                timer,
                clock,
                data,
            }),
            running: None,
        }
    }

    /// Starts with the first tick if the encoder is a serial one.
    pub(crate) fn prepare(&mut self, encoder: &EncoderSettings, rate_hz: u32) {
        if let Some(serial) = &encoder.serial {
            let running = |parts| Running::new(parts, serial, encoder, rate_hz);
            self.running = self.parts.take().map(running);
        }
    }

    /// The reading of this tick; none without a serial encoder.
    #[inline(always)]
    pub(crate) fn read(&mut self) -> Option<EncoderReading> {
        self.running.as_mut().map(Running::read)
    }
}

/// The work of the next tick.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Next {
    /// Start the timer beside the control tick's.
    Start,
    /// Take the frame.
    Take,
    /// Arm the streams again, which were stopped.
    Arm,
}

/// The input of a serial encoder that is used.
struct Running {
    spi: SPI3,
    timer: TIM6,
    encoder: SerialEncoder,
    counts: FrameCounts,
    bytes: u32,
    lead: u32,
    next: Next,
}

/// The controller of the streams.
fn dma() -> DMA1 {
    // SAFETY: the link's port owns this controller for streams 5 and 6, and the converter's bus uses stream 3; here only streams 0, 1
    // and 7 are used, and registers of flags that ones clear and zeros leave alone.
    unsafe { DMA1::steal() }
}

impl Running {
    /// An input that starts with the first tick.
    fn new(parts: Parts, serial: &SerialSettings, encoder: &EncoderSettings, rate_hz: u32) -> Self {
        let Parts {
            spi,
            timer,
            clock,
            data,
        } = parts;
        // SAFETY: the value is the manual's, as the constants say.
        spi.cr1()
            .write(|w| unsafe { w.bits(SPI_CR1 | rate(serial) << 3) });
        let _ = clock.into_alternate::<6>().speed(Speed::VeryHigh);
        // A line that is not driven rests high.
        let _ = data.into_alternate::<6>().internal_resistor(Pull::Up);
        // SAFETY: any reload is allowed; the timer's clock is 90 MHz as that of the control tick's.
        unsafe {
            timer.arr().write(|w| w.bits(TIMER_HZ / rate_hz - 1));
            timer.dier().write(|w| w.bits(UPDATE_DMA));
        }
        let data_register = spi.dr8().as_ptr() as u32;
        let kicked = spi.cr2().as_ptr() as u32;
        let dma = dma();
        for (stream, peripheral, memory, configuration) in [
            (RECEIVER, data_register, FRAME.address(), RECEIVER_CR),
            (SENDER, data_register, SENT.address(), SENDER_CR),
            (KICK, kicked, KICKED.address(), KICK_CR),
        ] {
            let stream = dma.st(stream);
            // SAFETY: the addresses are those of registers and of static memory; the configuration is the manual's.
            unsafe {
                stream.par().write(|w| w.pa().bits(peripheral));
                stream.m0ar().write(|w| w.m0a().bits(memory));
                stream.ndtr().write(|w| w.bits(1));
                stream.cr().write(|w| w.bits(configuration));
            }
        }
        Self {
            spi,
            timer,
            encoder: SerialEncoder::new(serial, encoder.counter_bits.into()),
            counts: FrameCounts::default(),
            bytes: serial.frame_bytes(encoder.counter_bits) as u32,
            lead: lead_cycles(serial, encoder.counter_bits),
            next: Next::Start,
        }
    }

    /// The reading of this tick. Waits for nothing.
    #[inline(never)]
    fn read(&mut self) -> EncoderReading {
        let next = self.next;
        self.next = Next::Take;
        match next {
            Next::Start => {
                self.start();
                // Nothing was asked for yet.
                EncoderReading {
                    fresh: false,
                    ..EncoderReading::of(0)
                }
            }
            Next::Take => {
                let received = self.receive();
                self.take(received)
            }
            Next::Arm => {
                self.arm();
                self.take(None)
            }
        }
    }

    /// Judges a frame, and shows how many were not whole.
    fn take(&mut self, received: Option<u64>) -> EncoderReading {
        let reading = self.encoder.take(received);
        let counts = self.encoder.counts();
        if counts != self.counts {
            self.counts = counts;
            publish(&counts);
        }
        reading
    }

    /// The frame, if it is complete, and the streams armed for the next one.
    #[inline(always)]
    fn receive(&mut self) -> Option<u64> {
        let dma = dma();
        let received = if dma.st(RECEIVER).ndtr().read().bits() == 0 {
            // The frame is read after the counter.
            fence(Ordering::Acquire);
            let shift = |word: u64, index| word << 8 | u64::from(FRAME.read(index));
            Some((0..MAX_FRAME_BYTES).fold(0, shift))
        } else {
            None
        };
        // SAFETY: no more requests until the timer's next end.
        self.spi.cr2().write(|w| unsafe { w.bits(0) });
        if received.is_some() {
            self.arm();
        } else {
            // SAFETY: the configuration is that of `new`.
            unsafe {
                dma.st(RECEIVER).cr().write(|w| w.bits(RECEIVER_CR));
                dma.st(SENDER).cr().write(|w| w.bits(SENDER_CR));
            }
            self.next = Next::Arm;
        }
        received
    }

    /// Starts the timer so that it ends by the lead before each control tick.
    #[cold]
    fn start(&mut self) {
        self.arm();
        // SAFETY: reading a counter changes nothing and needs no owner; the values are counts below the reload and the manual's.
        unsafe {
            dma().st(KICK).cr().write(|w| w.bits(KICK_CR | ON));
            let now = (*TIM7::ptr()).cnt().read().bits();
            self.timer.cnt().write(|w| w.bits(now + self.lead));
            self.timer.cr1().write(|w| w.bits(ENABLE));
        }
    }

    /// Arms the streams, which rest, for a frame.
    #[inline(always)]
    fn arm(&mut self) {
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

#[cold]
fn publish(counts: &FrameCounts) {
    let FrameCounts {
        line,
        check_sum,
        moved,
        errors,
        warnings,
        late,
        bridged,
    } = *counts;
    let counts = [line, check_sum, moved, errors, warnings, late, bridged];
    for (shown, count) in COUNTS.iter().zip(counts) {
        shown.store(count, Ordering::Relaxed);
    }
}

/// Logs frames that were not whole or warned, once a second at most.
pub(crate) struct FrameReport {
    shown: [u32; 7],
    looked: u32,
}

impl FrameReport {
    /// Nothing was logged.
    pub(crate) const fn new() -> Self {
        Self {
            shown: [0; 7],
            looked: 0,
        }
    }

    /// A turn of the idle loop.
    pub(crate) fn turn(&mut self) {
        let now = DWT::cycle_count();
        if now.wrapping_sub(self.looked) < CORE_HZ {
            return;
        }
        self.looked = now;
        let counts = COUNTS.each_ref().map(|count| count.load(Ordering::Relaxed));
        if counts == self.shown {
            return;
        }
        self.shown = counts;
        let [line, check_sum, moved, errors, warnings, late, bridged] = counts;
        defmt::warn!(
            "x: frames of the serial encoder since the start: {=u32} without a line, {=u32} with a wrong check sum, {=u32} \
             shifted, {=u32} with its error, {=u32} with its warning, {=u32} too late; {=u32} bridged",
            line,
            check_sum,
            moved,
            errors,
            warnings,
            late,
            bridged
        );
    }
}
