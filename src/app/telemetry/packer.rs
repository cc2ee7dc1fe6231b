//! The slow half of telemetry: samples into blocks for the link, gaps counted.

use heapless::Vec;
use quadrant_link::message::{Channel, MAX_CHANNELS, SampleWords, TelemetryBlock};

use super::read::shown;
use super::sampler::Sample;
use super::selection::Selection;
use quadrant_law::scalar::Scalar;

/// Makes blocks of samples.
#[derive(Clone, Debug, Default)]
pub struct Packer {
    channels: Vec<Channel, MAX_CHANNELS>,
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
            channels: selection.channels.clone(),
            generation,
            ..Self::default()
        }
    }

    /// Takes a sample of the law's number type. Gives the block that it completes, or that it does not follow on.
    pub fn push<S: Scalar>(&mut self, sample: &Sample) -> Option<TelemetryBlock> {
        if self.channels.is_empty() || sample.generation != self.generation {
            return None;
        }
        let missing = sample.sequence.wrapping_sub(self.next);
        self.next = sample.sequence.wrapping_add(1);
        self.dropped = self.dropped.wrapping_add(missing);
        let words = self.channels.iter().zip(sample.words);
        let words = words.map(|(channel, raw)| shown::<S>(*channel, raw));
        let begun = !self.block.words.is_empty();
        let appended = begun && missing == 0 && self.block.words.extend(words.clone());
        if appended {
            return None;
        }
        let mut begun = TelemetryBlock {
            generation: self.generation,
            sequence: sample.sequence,
            tick: sample.tick,
            dropped: self.dropped,
            channels: self.channels.len() as u8,
            words: SampleWords::new(),
        };
        // Cannot fail: a block holds many samples.
        let _ = begun.words.extend(words);
        let finished = core::mem::replace(&mut self.block, begun);
        (!finished.words.is_empty()).then_some(finished)
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
