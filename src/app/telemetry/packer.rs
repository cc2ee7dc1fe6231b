//! The slow half of telemetry: samples into blocks for the link, gaps counted.

use quadrant_link::message::{TelemetryBlock, Words};

use super::sampler::Sample;
use super::selection::Selection;

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
