//! The slow half of telemetry: samples into blocks for the link, gaps counted.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::sampler::Sample;
use super::selection::Selection;

/// Words that a block holds: 14 samples of 8 channels, 112 of one.
pub const BLOCK_WORDS: usize = 112;

/// Bytes of those words.
pub const BLOCK_BYTES: usize = 4 * BLOCK_WORDS;

/// Words of samples, little-endian, four bytes each.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Words(Vec<u8, BLOCK_BYTES>);

impl Words {
    /// A block without words.
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// Appends words; says whether there was room for all. Otherwise nothing is appended.
    #[must_use]
    pub fn extend(&mut self, words: impl ExactSizeIterator<Item = u32>) -> bool {
        let fits = words.len() <= BLOCK_WORDS - self.len();
        if fits {
            for word in words {
                // Cannot fail: the room was looked at before.
                let _ = self.0.extend_from_slice(&word.to_le_bytes());
            }
        }
        fits
    }

    /// Number of words in the block.
    pub fn len(&self) -> usize {
        self.0.len() / 4
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The words, in order; bytes beyond the last whole word, which only a wrong sender makes, are left out.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        let (words, _) = self.0.as_chunks();
        words.iter().map(|&bytes| u32::from_le_bytes(bytes))
    }
}

/// Consecutive samples of one selection. Sample `k` has the number `sequence + k`, and its tick is
/// `tick + k * decimation`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TelemetryBlock {
    /// The selection's generation, as the acknowledgement of its request told.
    pub generation: u8,
    /// Number of the first sample since the selection was made.
    pub sequence: u32,
    /// The control tick of the first sample.
    pub tick: u32,
    /// Samples of this selection that were dropped so far; wraps.
    pub dropped: u32,
    /// Words of a sample.
    pub channels: u8,
    /// The samples, one after the other.
    pub words: Words,
}

/// Makes blocks of samples.
#[derive(Clone, Debug, Default)]
pub struct Packer {
    channels: usize,
    generation: u8,
    /// The number that the next sample has, unless some were dropped.
    next: u32,
    dropped: u32,
    block: TelemetryBlock,
}

impl Packer {
    /// For the samples of a selection; those of any other generation are not let in.
    pub fn new(selection: &Selection, generation: u8) -> Self {
        Self {
            channels: selection.channels().len(),
            generation,
            ..Self::default()
        }
    }

    /// Takes a sample. Gives the block that it completes, or that it does not follow on.
    pub fn push(&mut self, sample: &Sample) -> Option<TelemetryBlock> {
        if self.channels == 0 || sample.generation != self.generation {
            return None;
        }
        let missing = sample.sequence.wrapping_sub(self.next);
        self.next = sample.sequence.wrapping_add(1);
        self.dropped = self.dropped.wrapping_add(missing);
        let words = &sample.words[..self.channels];
        let begun = !self.block.words.is_empty();
        let appended = begun && missing == 0 && self.block.words.extend(words.iter().copied());
        let finished = if appended { None } else { self.flush() };
        if !appended {
            self.block = TelemetryBlock {
                generation: self.generation,
                sequence: sample.sequence,
                tick: sample.tick,
                dropped: self.dropped,
                channels: self.channels as u8,
                words: Words::new(),
            };
            // Cannot fail: a block holds many samples.
            let _ = self.block.words.extend(words.iter().copied());
        }
        finished
    }

    /// Gives what has been gathered, so that slow samples do not wait for a block to fill.
    pub fn flush(&mut self) -> Option<TelemetryBlock> {
        let block = core::mem::take(&mut self.block);
        (!block.words.is_empty()).then_some(block)
    }

    /// Samples of this selection that were dropped so far; wraps.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
