//! Three quadrature encoders with index, each on a timer of its own.
//!
//! The timer counts all four edges of A and B (RM0390, 17.3.12 "Encoder interface mode") and captures the count at the
//! rising edge of the index on its third channel: "the capture, compare, prescaler, trigger output features continue to
//! work as normal" in that mode. All nine inputs have the same digital filter, so that all edges are late by the same
//! time and the index keeps its place among the counts.
//!
//! These timers do not report when both lines change at once: a count that is lost or gained that way shows as a distance
//! between index pulses that is wrong.

use core::sync::atomic::{AtomicU32, Ordering};

use quadrant::drivers::counter::ExtendedCounter;
use quadrant::hal;
use quadrant_law::encoder::EncoderReading;
use stm32f4xx_hal::gpio::{PA6, PA7, PB0, PB8, PB9, PB10, PC6, PC7, PC8, Pull};
use stm32f4xx_hal::pac::{TIM2, TIM3, TIM8};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use super::wiring::ENCODER_FILTER;

/// TIMx_CCMR1: channels 1 and 2 are inputs from their own pins (CC1S = CC2S = 01), filtered (IC1F, IC2F).
const CAPTURE_A_B: u32 = (0b01 | (ENCODER_FILTER.icf as u32) << 4) * 0x0101;
/// TIMx_CCMR2: so is channel 3 (CC3S = 01, IC3F).
const CAPTURE_INDEX: u32 = 0b01 | (ENCODER_FILTER.icf as u32) << 4;
/// TIMx_CCER: capture on channel 3 enabled (CC3E), at rising edges; A and B are not inverted.
const ENABLE_INDEX: u32 = 1 << 8;
/// TIMx_SMCR: encoder mode 3 (SMS = 011), counting at the edges of both lines.
const COUNT_BOTH: u32 = 0b011;
/// TIMx_CR1: counter enabled (CEN).
const ENABLE: u32 = 1;
/// TIMx_CR1: the filter clock is half the timer's (CKD = 01).
const HALVE_FILTER_CLOCK: u32 = 0b01 << 8;

/// The 16-bit counters of y and z, extended. They belong to the control tick; an erase of the flash, which holds that up
/// for longer than 16 bits may last, follows them meanwhile.
static Y_COUNT: AtomicU32 = AtomicU32::new(0);
static Z_COUNT: AtomicU32 = AtomicU32::new(0);

/// The pins of the encoders, as they are after reset: A, B and index of each.
pub(super) struct Pins {
    pub(super) x: (PB8, PB9, PB10),
    pub(super) y: (PA6, PA7, PB0),
    pub(super) z: (PC6, PC7, PC8),
}

/// Three position encoders.
pub(crate) struct Encoders {
    x: TIM2,
    y: TIM3,
    z: TIM8,
}

/// A 16-bit counter's count now, extended and remembered.
#[inline(always)]
fn follow(counted: &AtomicU32, raw: u16) -> ExtendedCounter {
    let mut counter = ExtendedCounter::at(counted.load(Ordering::Relaxed));
    counted.store(counter.read(raw), Ordering::Relaxed);
    counter
}

/// Follows the 16-bit counters in the control tick's place, which must not interrupt. Calls nothing, so that it can run
/// from RAM.
#[inline(always)]
pub(super) fn keep_up() {
    // SAFETY: reading a counter changes nothing and needs no owner.
    let (y, z) = unsafe { (&*TIM3::ptr(), &*TIM8::ptr()) };
    follow(&Y_COUNT, y.cnt().read().cnt().bits());
    follow(&Z_COUNT, z.cnt().read().cnt().bits());
}

/// Starts a timer as an encoder's counter, which wraps behind `$last`. The timers' types differ, their registers do not.
macro_rules! start {
    ($type:ty, $timer:expr, $last:expr, $control:expr, $rcc:expr) => {{
        <$type>::enable($rcc);
        <$type>::reset($rcc);
        // SAFETY: the values are the manual's for these registers, as the constants say.
        unsafe {
            $timer.ccmr1_input().write(|w| w.bits(CAPTURE_A_B as _));
            $timer.ccmr2_input().write(|w| w.bits(CAPTURE_INDEX as _));
            $timer.ccer().write(|w| w.bits(ENABLE_INDEX as _));
            $timer.smcr().write(|w| w.bits(COUNT_BOTH as _));
            $timer.arr().write(|w| w.bits($last.into()));
            $timer.cr1().write(|w| w.bits((ENABLE | $control) as _));
            // No event on the inputs before this point was an index.
            $timer.sr().write(|w| w.bits(0));
        }
    }};
}

/// The captured count, if there is one: CC3IF, which reading CCR3 clears.
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

impl Encoders {
    /// Starts counting from zero.
    pub(super) fn new(x: TIM2, y: TIM3, z: TIM8, pins: Pins, rcc: &mut Rcc) -> Self {
        // A line that is not driven rests high.
        let Pins {
            x: (xa, xb, xi),
            y: (ya, yb, yi),
            z: (za, zb, zi),
        } = pins;
        let _ = (
            xa.into_alternate::<1>().internal_resistor(Pull::Up),
            xb.into_alternate::<1>().internal_resistor(Pull::Up),
            xi.into_alternate::<1>().internal_resistor(Pull::Up),
            ya.into_alternate::<2>().internal_resistor(Pull::Up),
            yb.into_alternate::<2>().internal_resistor(Pull::Up),
            yi.into_alternate::<2>().internal_resistor(Pull::Up),
            za.into_alternate::<3>().internal_resistor(Pull::Up),
            zb.into_alternate::<3>().internal_resistor(Pull::Up),
            zi.into_alternate::<3>().internal_resistor(Pull::Up),
        );
        start!(TIM2, x, u32::MAX, 0, rcc);
        start!(TIM3, y, u16::MAX, 0, rcc);
        start!(TIM8, z, u16::MAX, HALVE_FILTER_CLOCK, rcc);
        Self { x, y, z }
    }
}

impl hal::Encoders for Encoders {
    /// All three wrap at 32 bits. The counts are read before the captures: a captured count is near the one read.
    #[inline(always)]
    fn read(&mut self) -> [EncoderReading; 3] {
        let x = self.x.cnt().read().cnt().bits();
        let y = follow(&Y_COUNT, self.y.cnt().read().cnt().bits());
        let z = follow(&Z_COUNT, self.z.cnt().read().cnt().bits());
        let reading = |count, index| EncoderReading {
            index,
            ..EncoderReading::of(count)
        };
        [
            reading(x, captured!(self.x)),
            reading(y.count(), captured!(self.y).map(|raw| y.captured(raw))),
            reading(z.count(), captured!(self.z).map(|raw| z.captured(raw))),
        ]
    }
}
