//! Curves of one variable, tabulated at settings time and interpolated in the tick.
//!
//! The nodes are spaced logarithmically: sixteen equal intervals in every octave from a power of two upwards, and one
//! interval from zero to it. A curve that bends near zero, as friction does, is resolved there without spending nodes
//! on its flat tail; and the interval of a value is found from its exponent and leading mantissa bits, without a
//! division or a search.

use crate::scalar::{OCTAVE_INTERVAL_BITS, OctaveStart, Quantity, Scalar};

/// Octaves of every table: from the end of the curve down to 2^-14 of it.
const OCTAVES: usize = 14;

/// Intervals of every table.
const INTERVALS: usize = 1 + (OCTAVES << OCTAVE_INTERVAL_BITS);

/// Nodes of every table.
pub(crate) const NODES: usize = INTERVALS + 1;

/// `CURVES` curves over one non-negative argument, sharing its look-up; constant beyond the end of the table.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct OctaveTable<S: Scalar, const CURVES: usize> {
    start: OctaveStart<S>,
    nodes: [[S; CURVES]; NODES],
}

/// The argument of node `index` of a table that ends at `2^end_exponent`.
fn node_argument(index: usize, end_exponent: i32) -> f64 {
    if index == 0 {
        return 0.0;
    }
    let intervals = 1 << OCTAVE_INTERVAL_BITS;
    let octave = ((index - 1) / intervals) as i32 + end_exponent - OCTAVES as i32;
    let within = ((index - 1) % intervals) as f64 / intervals as f64;
    libm::scalbn(1.0 + within, octave)
}

/// The smallest exponent with `2^exponent >= end`.
fn end_exponent(end: f64) -> i32 {
    // Exact, and smaller than a logarithm.
    let (fraction, exponent) = libm::frexp(end);
    if fraction > 0.5 {
        exponent
    } else {
        exponent - 1
    }
}

impl<S: Scalar, const CURVES: usize> OctaveTable<S, CURVES> {
    /// A table of zeros, to be [filled](Self::fill).
    pub fn blank() -> Self {
        Self {
            start: OctaveStart::default(),
            nodes: [[S::ZERO; CURVES]; NODES],
        }
    }

    /// A table that is [filled](Self::fill) at once.
    pub fn build(
        end: f64,
        argument: Quantity,
        values: [Quantity; CURVES],
        curve: impl Fn(f64) -> [f64; CURVES],
    ) -> Self {
        let mut table = Self::blank();
        table.fill(end, argument, values, &curve);
        table
    }

    /// Tabulates `curve` from zero to the first power of two at or above `end`, which must be positive and within the
    /// range of the `argument` quantity. `values` are the quantities of the curves. Settings time only.
    // In place, and once in the image for all curves: a table is larger than the firmware's stack ought to be.
    #[inline(never)]
    pub fn fill(
        &mut self,
        end: f64,
        argument: Quantity,
        values: [Quantity; CURVES],
        curve: &dyn Fn(f64) -> [f64; CURVES],
    ) {
        let end = end_exponent(end);
        for (index, node) in self.nodes.iter_mut().enumerate() {
            let exact = curve(node_argument(index, end));
            for ((slot, value), quantity) in node.iter_mut().zip(exact).zip(values) {
                *slot = S::quantise(value, quantity);
            }
        }
        self.start = OctaveStart::new(end - OCTAVES as i32, argument);
    }

    /// The curves at a non-negative argument, by linear interpolation.
    #[inline(always)]
    pub fn at(&self, argument: S) -> [S; CURVES] {
        let (interval, place) = argument.octave(self.start);
        let Some([low, high]) = self
            .nodes
            .get(interval..)
            .and_then(|rest| rest.first_chunk::<2>())
        else {
            return self.nodes[NODES - 1];
        };
        // Not `array::from_fn`, which is not inlined everywhere.
        let mut values = *low;
        for (value, high) in values.iter_mut().zip(high) {
            *value = *value + (*high - *value).times(place, Quantity::Fraction);
        }
        values
    }
}

/// The largest difference between `curve` and its table in `f64` arithmetic, over the middles and quarters of every
/// interval and the argument `beyond`. Settings time only: the validation of a curve's parameters asks for it.
pub(crate) fn interpolation_error(end: f64, beyond: f64, curve: impl Fn(f64) -> f64) -> f64 {
    let exponent = end_exponent(end);
    let mut worst = libm::fabs(curve(node_argument(INTERVALS, exponent)) - curve(beyond));
    for index in 0..INTERVALS {
        let (low, high) = (
            node_argument(index, exponent),
            node_argument(index + 1, exponent),
        );
        for place in [0.25, 0.5, 0.75] {
            let exact = curve(low + (high - low) * place);
            let table = curve(low) + (curve(high) - curve(low)) * place;
            worst = worst.max(libm::fabs(table - exact));
        }
    }
    worst
}
