//! A selection of channels, and its decimation.

use core::fmt;

use heapless::Vec;
use quadrant_link::message::{Channel, MAX_CHANNELS};

use super::Observation;
use super::read::read_raw;
use quadrant_law::scalar::Scalar;

/// Channels to sample together, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    pub(super) channels: Vec<Channel, MAX_CHANNELS>,
    decimation: u16,
}

/// A selection that cannot be sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SelectionError {
    /// The number of channels, which was none or more than [`MAX_CHANNELS`].
    Channels(usize),
    /// A decimation of zero.
    Decimation,
}

impl fmt::Display for SelectionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Channels(count) => write!(
                f,
                "channels: {count} are selected, 1 to {MAX_CHANNELS} can be sampled; select fewer"
            ),
            Self::Decimation => f.write_str(
                "decimation: 0 is not a number of ticks between samples; 1 samples every tick",
            ),
        }
    }
}

impl core::error::Error for SelectionError {}

impl Selection {
    /// One to [`MAX_CHANNELS`] channels, sampled every `decimation` ticks (1 to 65535).
    pub fn new(channels: &[Channel], decimation: u16) -> Result<Self, SelectionError> {
        if decimation == 0 {
            return Err(SelectionError::Decimation);
        }
        match Vec::from_slice(channels) {
            Ok(channels) if !channels.is_empty() => Ok(Self {
                channels,
                decimation,
            }),
            _ => Err(SelectionError::Channels(channels.len())),
        }
    }

    /// The channels, in the order of a sample's words.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Ticks from one sample to the next.
    pub const fn decimation(&self) -> u16 {
        self.decimation
    }

    /// Reads every channel's raw word into those given; what they have no room for is left out.
    #[inline(always)]
    pub(crate) fn read<S: Scalar, const N: usize>(
        &self,
        seen: &Observation<'_, S, N>,
        words: &mut [u32],
    ) {
        for (word, channel) in words.iter_mut().zip(&self.channels) {
            *word = read_raw(*channel, seen);
        }
    }
}
