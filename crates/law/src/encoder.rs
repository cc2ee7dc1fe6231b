//! From a hardware counter that wraps to a count that does not.

use crate::hint::cold_path;

use crate::units::{EncoderCount, POSITION_FRACTION_BITS, Position};

/// A board's reading of one encoder in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderReading {
    /// The raw counter. One narrower than 32 bits fills the low bits.
    pub count: u32,
    /// The raw counter latched at the index pulse, if one passed since the last tick.
    pub index: Option<u32>,
    /// The reading was taken in this tick.
    pub fresh: bool,
    /// The count is to be trusted: no change of both lines at once was seen since the last tick; a serial encoder's frame came
    /// undamaged and without the encoder's error bit.
    pub valid: bool,
}

impl EncoderReading {
    /// A fresh and valid reading without an index pulse.
    #[inline(always)]
    pub const fn of(count: u32) -> Self {
        Self {
            count,
            index: None,
            fresh: true,
            valid: true,
        }
    }
}

impl EncoderReading {
    /// True if nothing is wrong with the reading and no index pulse passed.
    pub(crate) const fn is_plain(&self) -> bool {
        self.index.is_none() && self.is_good()
    }

    /// True if nothing is wrong with the reading.
    pub(crate) const fn is_good(&self) -> bool {
        self.fresh & self.valid
    }
}

impl Default for EncoderReading {
    fn default() -> Self {
        Self::of(0)
    }
}

/// An encoder's counter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Encoder {
    /// Bits that a count lies above the counter's own: 0 for a 32-bit counter, 16 for a 16-bit one.
    shift: u32,
    reversed: bool,
    largest_step: i32,
    /// The place of an absolute encoder on the axis; none for an incremental one.
    anchor: Option<Anchor>,
}

/// A place of which an absolute encoder's count is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Anchor {
    /// The raw count there.
    pub raw: u32,
    /// The position there. Others are within half of the encoder's range of it.
    pub position: Position,
}

/// The memory of an encoder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncoderState {
    raw: u32,
    /// Held as a position: one saturating sum serves both.
    position: Position,
    started: bool,
    /// The last good reading of an absolute encoder whose position is not known yet.
    seen: Option<u32>,
}

impl EncoderState {
    /// The accumulated count; zero where the first reading was taken.
    pub const fn count(&self) -> EncoderCount {
        EncoderCount(self.position.0 >> POSITION_FRACTION_BITS)
    }

    /// The accumulated count as a position.
    pub const fn position(&self) -> Position {
        self.position
    }

    /// Shifts the accumulated count: what was zero becomes `offset`.
    pub(crate) fn shift(&mut self, offset: Position) {
        self.position = self.position.saturating_add(offset);
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
            anchor: None,
        }
    }

    /// The same, of an encoder that is absolute.
    pub const fn with_anchor(self, anchor: Option<Anchor>) -> Self {
        Self { anchor, ..self }
    }

    /// True if the encoder shows where the axis is.
    #[inline(always)]
    pub(crate) const fn is_absolute(&self) -> bool {
        self.anchor.is_some()
    }

    /// The distance from the accumulated position to that of an absolute encoder, once two readings in a row agree. `good`: nothing is
    /// wrong with the reading `raw`, which has been accumulated.
    pub(crate) fn find(&self, state: &mut EncoderState, raw: u32, good: bool) -> Option<Position> {
        let anchor = self.anchor?;
        let before = state.seen.take();
        let agrees = before.is_some_and(|before| self.is_plausible(self.between(before, raw)));
        if !(good && agrees) {
            state.seen = good.then_some(raw);
            return None;
        }
        let position = anchor.position + Position::from_step(self.between(anchor.raw, raw));
        Some(position - state.position)
    }

    /// The signed counts from one raw reading to another, towards larger positions.
    #[inline(always)]
    const fn between(&self, from: u32, to: u32) -> i32 {
        let step = (to.wrapping_sub(from) << self.shift) as i32 >> self.shift;
        if self.reversed {
            step.wrapping_neg()
        } else {
            step
        }
    }

    /// Takes a raw count: differences it, wrap-safe, accumulates, and returns the counts since the last reading. The first reading
    /// is where zero is. A step that is not [plausible](Self::is_plausible) is accumulated too, so that position is not lost when
    /// the limit was wrong.
    #[inline(always)]
    pub fn accumulate(&self, state: &mut EncoderState, raw: u32) -> i32 {
        let counts = self.between(state.raw, raw);
        state.raw = raw;
        if !state.started {
            cold_path();
            state.started = true;
            return 0;
        }
        state.position = state.position.saturating_add(Position::from_step(counts));
        counts
    }

    /// True if the axis can have moved that far in a tick.
    pub const fn is_plausible(&self, counts: i32) -> bool {
        // Between both ends, by one comparison.
        let largest = self.largest_step as u32;
        (counts as u32).wrapping_add(largest) <= largest.wrapping_mul(2)
    }

    /// The accumulated count at which the counter showed `raw`, within half its range of the last reading.
    pub(crate) const fn count_at(&self, state: &EncoderState, raw: u32) -> EncoderCount {
        let back = self.between(raw, state.raw);
        EncoderCount(state.count().0.wrapping_sub(back as i64))
    }
}
