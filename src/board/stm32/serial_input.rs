//! A serial encoder of x in the place of A, B and index: an SPI in mode 3, clocked by itself once a tick.
//!
//! Timer 6 has the control tick's period and ends so long before each tick that the frame has just come ([`SpiTimes`]). At its end DMA 1
//! writes a register of the SPI, which starts a frame. The tick takes it and arms the SPI for the next one. So the position is always
//! that of the same time before the tick, whatever the processor does.
//!
//! [`SpiTimes`]: quadrant::drivers::serial_encoder::times::SpiTimes

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::DWT;
use quadrant::drivers::serial_encoder::{FrameCounts, SerialEncoder};
use quadrant_law::encoder::EncoderReading;
use quadrant_settings::{EncoderSettings, SerialSettings};

use super::dma_memory::DmaMemory;
use crate::board::chip::pac::{DMA1, TIM6, TIM7};
use crate::board::chip::{CORE_HZ, SERIAL_TIMES, SerialMaster, SerialParts};

/// TIMx_CR1: counter enabled (CEN).
const ENABLE: u32 = 1;
/// TIMx_DIER: an update requests DMA (UDE).
const UPDATE_DMA: u32 = 1 << 8;

/// Stream of DMA 1 for the timer's update.
pub(crate) const KICK: usize = 1;
/// DMA_SxCR (RM0390, 9.5.5; RM0433, 15.5.5): priority (PL), again and again (CIRC), from memory (DIR); the chip adds what selects the
/// request, and the size.
const KICK_CR: u32 = SerialMaster::KICK_STREAM | 0b10 << 16 | 1 << 8 | 0b01 << 6;
/// DMA_SxCR, EN.
const ON: u32 = 1;

/// The value for the SPI's register.
#[unsafe(link_section = ".bss.dma.kick")]
static KICKED: DmaMemory<u32, 1> = DmaMemory::new([0]);

/// Frames that were not whole or warned, in the order of [`FrameCounts`], for the log.
static COUNTS: [AtomicU32; 7] = [const { AtomicU32::new(0) }; 7];

/// The input of a serial encoder. Until one is set, the pins are left as they are.
pub(crate) struct SerialInput {
    parts: Option<(SerialParts, TIM6)>,
    running: Option<Running>,
}

impl SerialInput {
    /// An input that is not used yet. DMA 1 is clocked; the timer is clocked as that of the control tick, and reset.
    pub(crate) const fn new(parts: SerialParts, timer: TIM6) -> Self {
        Self {
            parts: Some((parts, timer)),
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
    /// Arm the SPI again, which was stopped.
    Arm,
}

/// The input of a serial encoder that is used.
struct Running {
    master: SerialMaster,
    timer: TIM6,
    encoder: SerialEncoder,
    counts: FrameCounts,
    lead: u32,
    next: Next,
}

/// The controller of the stream.
fn controller() -> DMA1 {
    // SAFETY: others own this controller, or use it, for other streams; here only stream 1 is used.
    unsafe { DMA1::steal() }
}

impl Running {
    /// An input that starts with the first tick.
    fn new(
        (parts, timer): (SerialParts, TIM6),
        serial: &SerialSettings,
        encoder: &EncoderSettings,
        rate_hz: u32,
    ) -> Self {
        let bytes = serial.frame_bytes(encoder.counter_bits) as u32;
        let master = SerialMaster::new(parts, SERIAL_TIMES.rate(serial), bytes);
        KICKED.write(0, [SerialMaster::KICK]);
        let dma = controller();
        // SAFETY: any reload is allowed; the addresses are those of a register and of static memory; the rest is the manual's.
        unsafe {
            timer
                .arr()
                .write(|w| w.bits(SERIAL_TIMES.timer_hz / rate_hz - 1));
            timer.dier().write(|w| w.bits(UPDATE_DMA));
            let stream = dma.st(KICK);
            stream.par().write(|w| w.pa().bits(master.kicked()));
            stream.m0ar().write(|w| w.m0a().bits(KICKED.address()));
            stream.ndtr().write(|w| w.bits(1));
            stream.cr().write(|w| w.bits(KICK_CR));
        }
        Self {
            master,
            timer,
            encoder: SerialEncoder::new(serial, encoder.counter_bits.into()),
            counts: FrameCounts::default(),
            lead: SERIAL_TIMES.lead_cycles(serial, encoder.counter_bits),
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
                let received = self.master.receive();
                if received.is_some() {
                    self.master.arm();
                } else {
                    self.master.stop();
                    self.next = Next::Arm;
                }
                self.take(received)
            }
            Next::Arm => {
                self.master.arm();
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

    /// Starts the timer so that it ends by the lead before each control tick.
    #[cold]
    fn start(&mut self) {
        self.master.arm();
        // SAFETY: reading a counter changes nothing and needs no owner; the values are counts below the reload and the manual's.
        unsafe {
            controller().st(KICK).cr().write(|w| w.bits(KICK_CR | ON));
            let now = (*TIM7::ptr()).cnt().read().bits();
            self.timer.cnt().write(|w| w.bits(now + self.lead));
            self.timer.cr1().write(|w| w.bits(ENABLE));
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
