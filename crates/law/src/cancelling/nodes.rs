//! The nodes of the table over the spindle's frequencies. The slow half fills it.

/// Control periods in a step.
pub const STEP_TICKS: u32 = 4;

/// Least margin of phase, degrees: a harmonic is left out where the loop's phase may be wrong by more than the rest of a
/// right angle.
pub const LEAST_MARGIN_DEG: f64 = 30.0;

/// The table's first octave begins at 2^FIRST units, 2^-9 turns in a step: 4.9 Hz at 10 kHz. There are eight, of four intervals.
const FIRST: u32 = 23;
const INTERVAL_BITS: u32 = 2;

/// Nodes of the table: the last one, at 7/16 of a turn in a step, is 1094 Hz at 10 kHz.
pub(super) const NODES: usize = 8 << INTERVAL_BITS;

/// The frequency of a node, turns in a step.
pub(super) fn node_turns(index: usize) -> f64 {
    let intervals = 1usize << INTERVAL_BITS;
    let place = (index % intervals) as f64 / intervals as f64;
    let octave = (index / intervals) as i32 + FIRST as i32 - 32;
    libm::scalbn(1.0 + place, octave)
}

/// The interval of the table that holds a frequency, 2^-32 turns in a step, and the place in it with 30 fraction bits; none
/// below the first.
#[inline(always)]
pub(super) fn interval(turns: u32) -> Option<(usize, i32)> {
    let leading = turns.leading_zeros();
    let octave = (31 - FIRST).checked_sub(leading)?;
    let normal = turns << (leading & 31);
    let within = (normal << 1) >> (32 - INTERVAL_BITS);
    let place = ((normal << (1 + INTERVAL_BITS)) >> 2) as i32;
    Some((((octave << INTERVAL_BITS) + within) as usize, place))
}

/// A vector at a frequency, as real and imaginary part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Its growth by the error of one step, V/mm.
    pub growth: [f64; 2],
    /// The error of the last tick that it takes away, mm/V.
    pub response: [f64; 2],
}

/// The closed loop that is cancelled in.
pub trait CancellingLoop {
    /// A vector at a frequency; none where the phase's margin is below [`LEAST_MARGIN_DEG`].
    fn node(&self, frequency_hz: f64, rate_per_s: f64, period_s: f64) -> Option<Node>;
}
