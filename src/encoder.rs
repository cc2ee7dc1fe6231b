//! From a hardware counter that wraps to a count that does not.

use crate::units::{EncoderCount, POSITION_FRACTION_BITS, Position};

/// An incremental encoder's counter.
#[derive(Clone, Debug, PartialEq)]
pub struct Encoder {
    /// Bits that a count lies above the counter's own: 0 for a 32-bit counter, 16 for a 16-bit one.
    shift: u32,
    reversed: bool,
    largest_step: i32,
}

/// The memory of an encoder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncoderState {
    raw: u32,
    /// Held as a position: one saturating sum serves both.
    position: Position,
    started: bool,
}

impl EncoderState {
    /// The accumulated count; zero where the first reading was taken.
    #[inline(always)]
    pub const fn count(&self) -> EncoderCount {
        EncoderCount(self.position.0 >> POSITION_FRACTION_BITS)
    }

    /// The accumulated count as a position.
    #[inline(always)]
    pub const fn position(&self) -> Position {
        self.position
    }
}

impl Encoder {
    /// An encoder on a counter of `counter_bits` (1 to 32) that moves at most `largest_step` counts in a tick.
    /// Settings time only.
    pub const fn new(counter_bits: u32, reversed: bool, largest_step: i32) -> Self {
        Self {
            shift: 32 - counter_bits,
            reversed,
            largest_step,
        }
    }

    /// Takes a raw reading: differences it, wrap-safe, and accumulates. Says whether the step is plausible; an
    /// implausible one is accumulated too, so that position is not lost when the limit was wrong.
    #[inline(always)]
    pub fn update(&self, state: &mut EncoderState, raw: u32) -> bool {
        let step = (raw.wrapping_sub(state.raw) << self.shift) as i32 >> self.shift;
        state.raw = raw;
        if !state.started {
            state.started = true;
            return true;
        }
        let directed = if self.reversed {
            step.wrapping_neg()
        } else {
            step
        };
        state.position = state.position.saturating_add(Position::from_step(directed));
        step.unsigned_abs() <= self.largest_step as u32
    }
}
