//! The timers of the encoders: x has 32 bits, y and z have 16, extended.

use stm32f4xx_hal::gpio::{PA6, PA7, PB0, PB8, PB9, PB10, PC6, PC7, PC8, Pull};
use stm32f4xx_hal::pac::{TIM2, TIM3, TIM8};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::board::stm32::encoders::{
    Counter, Encoders, Extended, captured, narrow_counter, start_counting,
};
use crate::board::stm32::serial_input::SerialInput;

/// TIMx_CR1: the filter clock is half the timer's (CKD = 01).
const HALVE_FILTER_CLOCK: u32 = 0b01 << 8;

static Y_COUNT: Extended = Extended::new();
static Z_COUNT: Extended = Extended::new();

narrow_counter!(TIM3, Y_COUNT);
narrow_counter!(TIM8, Z_COUNT);

impl Counter for TIM2 {
    #[inline(always)]
    fn count(&self) -> u32 {
        self.cnt().read().cnt().bits()
    }

    #[inline(always)]
    fn captured(&self) -> Option<u32> {
        captured!(self)
    }
}

/// The pins of the encoders, as they are after reset: A, B and index of each.
pub(super) struct Pins {
    pub(super) x: (PB8, PB9, PB10),
    pub(super) y: (PA6, PA7, PB0),
    pub(super) z: (PC6, PC7, PC8),
}

/// Follows the 16-bit counters in the control tick's place, which must not interrupt: an erase of the flash holds it up for longer
/// than 16 bits may last. Calls nothing, so that it can run from RAM.
#[inline(always)]
pub(super) fn keep_up() {
    // SAFETY: reading a counter changes nothing and needs no owner.
    let (y, z) = unsafe { (&*TIM3::ptr(), &*TIM8::ptr()) };
    Y_COUNT.follow(y.cnt().read().cnt().bits());
    Z_COUNT.follow(z.cnt().read().cnt().bits());
}

/// Starts counting from zero.
pub(super) fn start(
    timers: (TIM2, TIM3, TIM8),
    pins: Pins,
    serial: SerialInput,
    rcc: &mut Rcc,
) -> Encoders {
    let (x, y, z) = timers;
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
    TIM2::enable(rcc);
    TIM2::reset(rcc);
    TIM3::enable(rcc);
    TIM3::reset(rcc);
    TIM8::enable(rcc);
    TIM8::reset(rcc);
    start_counting!(x, u32::MAX, 0);
    start_counting!(y, u16::MAX, 0);
    start_counting!(z, u16::MAX, HALVE_FILTER_CLOCK);
    Encoders::new(x, y, z, serial)
}
