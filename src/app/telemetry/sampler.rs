//! The fast half of telemetry: at most one sample a tick, at most [`MAX_CHANNELS`] reads.

use quadrant_link::message::MAX_CHANNELS;

use super::{Observation, Selection};
use quadrant_law::scalar::Scalar;

/// The selection to sample. The slow half builds it and passes it on whole.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sampler {
    selection: Option<Selection>,
    /// Distinguishes samples of this selection from those of the one before.
    generation: u8,
}

/// The memory of the sampler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SamplerState {
    generation: u8,
    /// Ticks until the next sample.
    wait: u16,
    sequence: u32,
}

/// One sample of a selection, on its way from the fast half to the slow one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// Number of the sample since its selection was made; a gap is what a full queue has dropped.
    pub sequence: u32,
    /// The control tick that it shows.
    pub tick: u32,
    /// The generation of its selection.
    pub generation: u8,
    /// The channels' raw words; those beyond the selection are zero.
    pub words: [u32; MAX_CHANNELS],
}

impl Sampler {
    /// Samples `selection`, or nothing. `generation` differs from that of the sampler before.
    pub const fn new(selection: Option<Selection>, generation: u8) -> Self {
        Self {
            selection,
            generation,
        }
    }

    /// After a tick: a sample, if one is due. A sample that the caller cannot pass on is simply let go; its number is
    /// missing then.
    #[inline(always)]
    pub fn step<S: Scalar, const N: usize>(
        &self,
        state: &mut SamplerState,
        seen: &Observation<'_, S, N>,
    ) -> Option<Sample> {
        let selection = self.selection.as_ref()?;
        if state.generation != self.generation {
            *state = SamplerState {
                generation: self.generation,
                ..SamplerState::default()
            };
        }
        if let Some(wait) = state.wait.checked_sub(1) {
            state.wait = wait;
            return None;
        }
        state.wait = selection.decimation().saturating_sub(1);
        Some(Self::sample(selection, state, seen))
    }

    #[inline(never)]
    fn sample<S: Scalar, const N: usize>(
        selection: &Selection,
        state: &mut SamplerState,
        seen: &Observation<'_, S, N>,
    ) -> Sample {
        let mut sample = Sample {
            sequence: state.sequence,
            tick: seen.tick(),
            generation: state.generation,
            words: [0; MAX_CHANNELS],
        };
        selection.read(seen, &mut sample.words);
        state.sequence = state.sequence.wrapping_add(1);
        sample
    }
}
