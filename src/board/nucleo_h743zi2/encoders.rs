//! The timers of the encoders, of 16 bits each, extended. An erase of the flash does not hold up the control tick here.

use stm32h7::stm32h743v::{TIM1, TIM3, TIM4};

use super::chip::FILTER_CLOCK;
use super::gpio::{self, Pin, Pull};
use crate::board::stm32::encoders::{Encoders, Extended, narrow_counter, start_counting};
use crate::board::stm32::serial_input::SerialInput;

static X_COUNT: Extended = Extended::new();
static Y_COUNT: Extended = Extended::new();
static Z_COUNT: Extended = Extended::new();

narrow_counter!(TIM1, X_COUNT);
narrow_counter!(TIM3, Y_COUNT);
narrow_counter!(TIM4, Z_COUNT);

/// Starts counting from zero. The timers are clocked and reset.
pub(super) fn start((x, y, z): (TIM1, TIM3, TIM4), serial: SerialInput) -> Encoders {
    // A line that is not driven rests high. Alternate functions: DS12110, tables of ports C to E.
    Pin::<{ gpio::E }, 9>::alternate(1, Pull::Up);
    Pin::<{ gpio::E }, 11>::alternate(1, Pull::Up);
    Pin::<{ gpio::E }, 13>::alternate(1, Pull::Up);
    Pin::<{ gpio::C }, 6>::alternate(2, Pull::Up);
    Pin::<{ gpio::C }, 7>::alternate(2, Pull::Up);
    Pin::<{ gpio::C }, 8>::alternate(2, Pull::Up);
    Pin::<{ gpio::D }, 12>::alternate(2, Pull::Up);
    Pin::<{ gpio::D }, 13>::alternate(2, Pull::Up);
    Pin::<{ gpio::D }, 14>::alternate(2, Pull::Up);
    start_counting!(x, u16::MAX, FILTER_CLOCK);
    start_counting!(y, u16::MAX, FILTER_CLOCK);
    start_counting!(z, u16::MAX, FILTER_CLOCK);
    Encoders::new(x, y, z, serial)
}
