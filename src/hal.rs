//! Traits of a board.
//!
//! embedded-hal 1.0 has no encoder, no converter, no watchdog and no port that is read and written without waiting; these
//! traits are ours, and this is their only place. They speak in raw words: what a word means is
//! [`settings`](quadrant_settings). Flash for stored settings is an `embedded_storage::nor_flash::NorFlash` that knows the
//! enable line ([`SettingsFlash`]).

use embedded_storage::nor_flash::NorFlash;

use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety;
use quadrant_law::stage::Outputs;
use quadrant_settings::EncoderSettings;

/// The three axes' encoders.
pub trait Encoders {
    /// The axes of which the board reads a serial encoder.
    const SERIAL_AXES: [bool; 3] = [false; 3];

    /// Prepares for encoders with these settings and `rate_hz` readings per second; once, just before the control ticks start. A serial
    /// encoder of an axis that is none of [`SERIAL_AXES`](Self::SERIAL_AXES) is refused before.
    fn prepare(&mut self, _settings: &[EncoderSettings; 3], _rate_hz: u32) {}

    /// Reads all three; to be called once a tick. A counter narrower than 32 bits fills the low
    /// bits, and an index pulse is reported once.
    fn read(&mut self) -> [EncoderReading; 3];
}

/// The three axes' amplifiers: converters, their common enable line, and the holding brake.
pub trait Amplifiers {
    /// Begins a tick: checks that what the last [`write`](Self::write) started came to its end, and starts what can go on beside
    /// the computation. If it did not, the amplifiers are disabled, and [`mismatches`](Self::mismatches) says so.
    #[inline(always)]
    fn begin(&mut self) {}

    /// Sets all three converters together, or starts to, the enable line and the current of the brake. When disabling, line and
    /// brake go first.
    fn write(&mut self, outputs: &Outputs);

    /// Whose converters held another word than the one written when the last call of [`begin`](Self::begin) or
    /// [`write`](Self::write) looked. If any did, that call has disabled the amplifiers.
    fn mismatches(&self) -> [bool; 3] {
        [false; 3]
    }
}

/// The limit and home switches, the amplifiers' faults and the emergency stop.
pub trait Switches {
    /// All of them, read in this call. One is active when the switch is pressed, the amplifier at fault, or a wire broken.
    fn read(&mut self) -> safety::Switches;
}

/// Inputs of another control by step and direction, in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PulseReadings {
    /// Steps so far of each axis, 32 bits wide and wrapping; they count backwards while the direction line is on.
    pub counts: [u32; 3],
    /// The axes of which steps may have been lost since the last tick.
    pub lost: [bool; 3],
    /// The line SERVO ON: the control wants its axes driven.
    pub servo_on: bool,
}

/// The lines of another control that leads axes by step and direction.
pub trait Pulses {
    /// Reads all of them; to be called once a tick. A broken wire of SERVO ON reads as off.
    fn read(&mut self) -> PulseReadings;

    /// Sets the line ALARM. It shows an alarm by itself while the processor is in reset.
    fn set_alarm(&mut self, alarm: bool);
}

/// A serial port that never waits.
pub trait Serial {
    /// Takes what has arrived, as much as `into` holds; returns how many bytes that was.
    fn read(&mut self, into: &mut [u8]) -> usize;

    /// Sends the beginning of `bytes`; returns how many were taken, 0 while earlier ones are on their way.
    fn write(&mut self, bytes: &[u8]) -> usize;

    /// True once everything that was taken has left: a reset cuts nothing off then.
    fn has_sent(&mut self) -> bool {
        true
    }
}

/// The flash that settings are stored in. Writing it may stop the processor for as long as an erasure takes.
pub trait SettingsFlash: NorFlash {
    /// True if the amplifiers' enable line is low, as the pin itself shows. Asked before every erasure and every set that is
    /// written, independent of the tasks.
    fn outputs_are_off(&self) -> bool;
}

/// A watchdog that resets the processor unless it is fed.
pub trait Watchdog {
    /// Starts it, for good; one that gave the start more time has its usual time from here on. The first [`feed`](Self::feed) must follow within its time.
    fn start(&mut self);

    /// Feeds it. `driving`: the amplifiers are enabled. While they are not, a board may let a debugger stop the
    /// processor without being reset; while they are, a stopped processor must be.
    fn feed(&mut self, driving: bool);
}

/// The cause of the processor's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The supply came up.
    PowerOn,
    /// The supply sagged below the processor's threshold.
    BrownOut,
    /// The reset pin: the button, or a debugger.
    Pin,
    /// The firmware itself.
    Software,
    /// The watchdog: nobody fed it.
    Watchdog,
    /// The processor's security against entering a low-power mode.
    LowPower,
    /// The hardware does not say.
    Unknown,
}

impl ResetCause {
    /// The cause in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::PowerOn => "power-on",
            Self::BrownOut => "brown-out",
            Self::Pin => "reset pin",
            Self::Software => "software",
            Self::Watchdog => "watchdog",
            Self::LowPower => "illegal low-power mode",
            Self::Unknown => "unknown",
        }
    }

    /// True if the run before ended by a failure: neither of its own accord nor on request.
    pub const fn is_alarming(self) -> bool {
        matches!(self, Self::BrownOut | Self::Watchdog | Self::LowPower)
    }
}
