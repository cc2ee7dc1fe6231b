//! Meaning of the bits in the board's words. No registers here: the tests of the library include this file and run it on the host.

use quadrant::drivers::input_filter::{FASTEST_COUNTS_PER_S, InputFilter, shortest_level_ns};
use quadrant::drivers::reset_flags::ResetFlags;
use quadrant::drivers::serial_encoder::times::SpiTimes;
use quadrant::drivers::switch_inputs::SwitchInputs;

/// The filter of all nine encoder inputs, at 90 MHz: timer 8 runs at twice that and halves its filter clock.
pub(crate) const ENCODER_FILTER: InputFilter =
    InputFilter::strongest(90_000_000, 1, shortest_level_ns(FASTEST_COUNTS_PER_S));

/// Timer 6, at the control tick's clock, and SPI 3, at that of APB 1.
pub(crate) const SERIAL_TIMES: SpiTimes = SpiTimes {
    timer_hz: 90_000_000,
    spi_hz: 45_000_000,
};

/// Ports A and C.
pub(crate) const INPUTS: SwitchInputs = SwitchInputs {
    first_fault: 8,
    first_limit: 0,
    first_home: 10,
};

/// RCC_CSR (RM0390, 6.3.21): LPWRRSTF, WWDGRSTF and IWDGRSTF, SFTRSTF, PORRSTF, BORRSTF, PINRSTF.
pub(crate) const RESETS: ResetFlags = ResetFlags {
    low_power: 1 << 31,
    watchdog: 1 << 30 | 1 << 29,
    software: 1 << 28,
    power_on: 1 << 27,
    brown_out: 1 << 25,
    pin: 1 << 26,
};
