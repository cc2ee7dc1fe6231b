//! The two traits that a board gives to the control law.
//!
//! embedded-hal 1.0 has neither an encoder nor a converter trait; these are ours, and this is their only place. They
//! speak in raw words: what a word means is [`settings`](crate::settings).

use crate::units::DacCode;

/// The three axes' encoder counters.
pub trait Encoders {
    /// The raw counters, all read in this call. A counter narrower than 32 bits fills the low bits.
    fn counts(&mut self) -> [u32; 3];
}

/// The three axes' amplifiers: converters and their common enable line.
pub trait Amplifiers {
    /// Sets all three converters together, and the enable line. When disabling, the line goes first.
    fn write(&mut self, codes: [DacCode; 3], enabled: bool);
}
