//! Times of the serial encoder's input. No registers here: the tests of the library include this file and run it on the host.

use quadrant_settings::SerialSettings;

/// Clock of timer 6, and of the control tick's.
pub(crate) const TIMER_HZ: u32 = 90_000_000;
/// Clock of SPI 3: that of APB 1.
const BUS_HZ: f64 = 45e6;
/// Largest value of SPI_CR1, bits BR: the clock divided by 256.
const SLOWEST: u16 = 7;
/// From the last bit to the control tick, cycles of timer 6, 2 us: the SPI starts within three of its bus' cycles and a bit, and a
/// DMA access may be held up by two others to APB 1, of 12 cycles each.
const MARGIN_CYCLES: u32 = 180;

/// Value of SPI_CR1, bits BR, for the fastest clock that the settings allow: the bus' clock divided by two to that power and one.
pub(crate) fn rate(settings: &SerialSettings) -> u16 {
    let mut rate = 0;
    let mut clock_hz = 0.5 * BUS_HZ;
    while rate < SLOWEST && clock_hz > settings.clock_hz {
        rate += 1;
        clock_hz *= 0.5;
    }
    rate
}

/// Cycles of timer 6 from the encoder's first clock edge to the control tick: the age of the position.
pub(crate) fn lead_cycles(settings: &SerialSettings, counter_bits: u8) -> u32 {
    let bit_cycles = 4 << rate(settings);
    8 * settings.frame_bytes(counter_bits) as u32 * bit_cycles + MARGIN_CYCLES
}
