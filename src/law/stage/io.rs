//! What one tick reads and writes.

use crate::law::encoder::EncoderReading;
use crate::law::safety::{Command, Switches};
use crate::law::units::DacCode;

/// What one tick reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// What the encoders say.
    pub readings: [EncoderReading; 3],
    /// What the board's digital inputs say.
    pub switches: Switches,
    /// A command to act on, once.
    pub command: Option<Command>,
    /// The settings of an axis were exchanged since the last tick.
    pub settings_changed: [bool; 3],
    /// The last tick ended after its deadline.
    pub deadline_missed: bool,
    /// The host whose set points the axes follow has fallen silent.
    pub link_lost: bool,
}

impl Inputs {
    /// Sets fresh and valid raw counts in place of what the encoders said.
    #[inline(always)]
    pub fn set_counts(&mut self, counts: [u32; 3]) {
        self.readings = counts.map(EncoderReading::of);
    }

    /// Fresh and valid raw counts, and nothing else.
    #[inline(always)]
    pub fn of_counts(counts: [u32; 3]) -> Self {
        Self {
            readings: counts.map(EncoderReading::of),
            ..Self::default()
        }
    }
}

/// What one tick writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The converters' words; zero unless enabled.
    pub codes: [DacCode; 3],
    /// Whether the amplifiers are enabled.
    pub enabled: bool,
}
