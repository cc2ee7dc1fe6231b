//! Times of the SPI of a serial encoder.

use quadrant_settings::SerialSettings;

/// The largest divider of an SPI's clock is 256, two to the power of this and one.
const SLOWEST: u32 = 7;
/// Parts of a second from the last bit to the control tick, beside a bit, in which the SPI starts: 2 us. A DMA access may be held up by
/// two others to the same bus, of 12 cycles each, and by a few cycles between two clocks.
const MARGIN: u32 = 500_000;

/// Clocks of an SPI that a timer starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpiTimes {
    /// Clock of the timer, Hz.
    pub timer_hz: u32,
    /// Clock of the SPI, before its divider, Hz. Twice the timer's clock is a multiple of it.
    pub spi_hz: u32,
}

impl SpiTimes {
    /// Setting of the divider for the fastest clock that the settings allow: the SPI's clock divided by two to that power and one.
    pub fn rate(&self, settings: &SerialSettings) -> u32 {
        let mut rate = 0;
        let mut clock_hz = 0.5 * f64::from(self.spi_hz);
        while rate < SLOWEST && clock_hz > settings.clock_hz {
            rate += 1;
            clock_hz *= 0.5;
        }
        rate
    }

    /// Cycles of the timer from its end, which starts a frame, to the control tick: the largest age of the position.
    pub fn lead_cycles(&self, settings: &SerialSettings, counter_bits: u8) -> u32 {
        let bit_cycles = (2 * self.timer_hz / self.spi_hz) << self.rate(settings);
        let bits = 8 * settings.frame_bytes(counter_bits) as u32 + 1;
        bits * bit_cycles + self.timer_hz / MARGIN
    }
}
