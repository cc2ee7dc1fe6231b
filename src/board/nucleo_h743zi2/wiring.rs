//! Meaning of the bits in the board's words. No registers here: the tests of the library include this file and run it on the host.

use quadrant::drivers::input_filter::{FASTEST_COUNTS_PER_S, InputFilter, shortest_level_ns};
use quadrant::drivers::reset_flags::ResetFlags;
use quadrant::drivers::serial_encoder::times::SpiTimes;
use quadrant::drivers::switch_inputs::SwitchInputs;

/// The filter of all encoder inputs: the timers run at 240 MHz, a quarter of which is the filter's clock (CKD = 10).
pub(crate) const ENCODER_FILTER: InputFilter =
    InputFilter::strongest(240_000_000, 4, shortest_level_ns(FASTEST_COUNTS_PER_S));

/// Timer 6, at the control tick's clock behind its prescaler, and SPI 2, at output Q of PLL 1 (RM0433, 8.7.20: SPI123SEL = 0).
pub(crate) const SERIAL_TIMES: SpiTimes = SpiTimes {
    timer_hz: 120_000_000,
    spi_hz: 48_000_000,
};

/// Ports D and F.
pub(crate) const INPUTS: SwitchInputs = SwitchInputs {
    first_fault: 3,
    first_limit: 0,
    first_home: 7,
};

/// RCC_RSR (RM0433, 8.7.39): LPWRRSTF, WWDG1RSTF and IWDG1RSTF, SFTRSTF, PORRSTF, BORRSTF, PINRSTF.
pub(crate) const RESETS: ResetFlags = ResetFlags {
    low_power: 1 << 30,
    watchdog: 1 << 28 | 1 << 26,
    software: 1 << 24,
    power_on: 1 << 23,
    brown_out: 1 << 21,
    pin: 1 << 22,
};
