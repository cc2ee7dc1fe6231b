//! Three quadrature encoders with index, each on a timer of its own.
//!
//! The timer counts all four edges of A and B (RM0390, 17.3.12 "Encoder interface mode"; RM0433, chapter 39) and captures the count
//! at the rising edge of the index on its third channel: "the capture, compare, prescaler, trigger output features continue to
//! work as normal" in that mode. All nine inputs have the same digital filter, so that all edges are late by the same
//! time and the index keeps its place among the counts.
//!
//! These timers do not report when both lines change at once: a count that is lost or gained that way shows as a distance
//! between index pulses that is wrong.

use core::sync::atomic::{AtomicU32, Ordering};

use quadrant::drivers::counter::ExtendedCounter;
use quadrant::hal;
use quadrant_law::encoder::EncoderReading;
use quadrant_settings::EncoderSettings;

use super::serial_input::SerialInput;
use crate::board::chip::{ENCODER_FILTER, X, Y, Z};

/// TIMx_CCMR1: channels 1 and 2 are inputs from their own pins (CC1S = CC2S = 01), filtered (IC1F, IC2F).
pub(crate) const CAPTURE_A_B: u32 = (0b01 | (ENCODER_FILTER.icf as u32) << 4) * 0x0101;
/// TIMx_CCMR2: so is channel 3 (CC3S = 01, IC3F).
pub(crate) const CAPTURE_INDEX: u32 = 0b01 | (ENCODER_FILTER.icf as u32) << 4;
/// TIMx_CCER: capture on channel 3 enabled (CC3E), at rising edges; A and B are not inverted.
pub(crate) const ENABLE_INDEX: u32 = 1 << 8;
/// TIMx_SMCR: encoder mode 3 (SMS = 011), counting at the edges of both lines.
pub(crate) const COUNT_BOTH: u32 = 0b011;
/// TIMx_CR1: counter enabled (CEN).
pub(crate) const ENABLE: u32 = 1;

/// The count of a 16-bit counter as a 32-bit one. It belongs to the control tick; what holds that up for longer than 16 bits may
/// last follows it meanwhile.
pub(crate) struct Extended(AtomicU32);

impl Extended {
    /// At zero.
    pub(crate) const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Takes the counter's 16 bits, and remembers. Calls nothing, so that it can run from RAM.
    #[inline(always)]
    pub(crate) fn follow(&self, raw: u16) -> u32 {
        let mut counter = ExtendedCounter::at(self.0.load(Ordering::Relaxed));
        let count = counter.read(raw);
        self.0.store(count, Ordering::Relaxed);
        count
    }

    /// The count at which the hardware captured 16 bits, not far from the last one that was taken.
    #[inline(always)]
    pub(crate) fn captured(&self, raw: u16) -> u32 {
        ExtendedCounter::at(self.0.load(Ordering::Relaxed)).captured(raw)
    }
}

/// A timer as an encoder's counter.
pub(crate) trait Counter {
    /// The count now, 32 bits wide.
    fn count(&self) -> u32;
    /// The count captured at the index since this was asked last.
    fn captured(&self) -> Option<u32>;
}

/// Starts a timer, clocked and reset, as an encoder's counter, which wraps behind `$last`; `$control` are further bits of CR1. The
/// timers' types differ, their registers do not.
macro_rules! start_counting {
    ($timer:expr, $last:expr, $control:expr) => {{
        use $crate::board::stm32::encoders as at;
        // SAFETY: the values are the manual's for these registers, as the constants say.
        unsafe {
            $timer.ccmr1_input().write(|w| w.bits(at::CAPTURE_A_B as _));
            $timer
                .ccmr2_input()
                .write(|w| w.bits(at::CAPTURE_INDEX as _));
            $timer.ccer().write(|w| w.bits(at::ENABLE_INDEX as _));
            $timer.smcr().write(|w| w.bits(at::COUNT_BOTH as _));
            $timer.arr().write(|w| w.bits($last.into()));
            $timer.cr1().write(|w| w.bits((at::ENABLE | $control) as _));
            // No event on the inputs before this point was an index.
            $timer.sr().write(|w| w.bits(0));
        }
    }};
}
pub(crate) use start_counting;

/// The captured bits, if there are any: CC3IF, which reading CCR3 clears.
macro_rules! captured {
    ($timer:expr) => {
        $timer
            .sr()
            .read()
            .cc3if()
            .bit_is_set()
            .then(|| $timer.ccr3().read().ccr().bits())
    };
}
pub(crate) use captured;

/// Makes a 16-bit timer a [`Counter`], with the static that extends it.
macro_rules! narrow_counter {
    ($type:ty, $extended:ident) => {
        impl $crate::board::stm32::encoders::Counter for $type {
            #[inline(always)]
            fn count(&self) -> u32 {
                $extended.follow(self.cnt().read().bits() as u16)
            }

            #[inline(always)]
            fn captured(&self) -> Option<u32> {
                $crate::board::stm32::encoders::captured!(self)
                    .map(|raw| $extended.captured(raw as u16))
            }
        }
    };
}
pub(crate) use narrow_counter;

/// Three position encoders.
pub(crate) struct Encoders {
    x: X,
    y: Y,
    z: Z,
    serial: SerialInput,
}

impl Encoders {
    /// The timers, which count, and the input of a serial encoder of x.
    pub(crate) const fn new(x: X, y: Y, z: Z, serial: SerialInput) -> Self {
        Self { x, y, z, serial }
    }
}

impl hal::Encoders for Encoders {
    const SERIAL_AXES: [bool; 3] = [true, false, false];

    fn prepare(&mut self, [x, ..]: &[EncoderSettings; 3], rate_hz: u32) {
        self.serial.prepare(x, rate_hz);
    }

    /// All three wrap at 32 bits. The counts are read before the captures: a captured count is near the one read.
    #[inline(always)]
    fn read(&mut self) -> [EncoderReading; 3] {
        let (x, y, z) = (self.x.count(), self.y.count(), self.z.count());
        let reading = |count, index| EncoderReading {
            index,
            ..EncoderReading::of(count)
        };
        let of_x = match self.serial.read() {
            Some(of_x) => of_x,
            None => reading(x, self.x.captured()),
        };
        [
            of_x,
            reading(y, self.y.captured()),
            reading(z, self.z.captured()),
        ]
    }
}
