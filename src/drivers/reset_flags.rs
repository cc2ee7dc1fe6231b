//! The cause of a reset from the flags that the chip's clock controller keeps.

use crate::hal::ResetCause;

/// Masks of the flags in the controller's word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResetFlags {
    /// An illegal low-power mode.
    pub low_power: u32,
    /// Any watchdog.
    pub watchdog: u32,
    /// The software.
    pub software: u32,
    /// Power-on.
    pub power_on: u32,
    /// Brown-out.
    pub brown_out: u32,
    /// The reset pin.
    pub pin: u32,
}

impl ResetFlags {
    /// The cause. Every reset pulls the reset pin, too, and power-on sets the brown-out flag as well: the more special flag decides.
    pub const fn cause(self, word: u32) -> ResetCause {
        if word & self.low_power != 0 {
            ResetCause::LowPower
        } else if word & self.watchdog != 0 {
            ResetCause::Watchdog
        } else if word & self.software != 0 {
            ResetCause::Software
        } else if word & self.power_on != 0 {
            ResetCause::PowerOn
        } else if word & self.brown_out != 0 {
            ResetCause::BrownOut
        } else if word & self.pin != 0 {
            ResetCause::Pin
        } else {
            ResetCause::Unknown
        }
    }
}
