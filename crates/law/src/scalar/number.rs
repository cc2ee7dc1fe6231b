//! The operations that the control law needs of a number type.

use crate::hint::cold_path;
use core::fmt::Debug;
use core::ops::{Add, Neg, Sub};

use super::quantity::Quantity;

/// A number type that the control law runs on.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// A constant that multiplies a signal, made by [`Scalar::gain`].
    type Gain: Copy + Debug + Default + PartialEq + Send + Sync + 'static;

    /// A sum over many ticks, wide enough that terms far below the signal's step still count.
    type Sum: Copy + Debug + Default + PartialEq + Send + Sync + 'static;

    /// Zero of every quantity.
    const ZERO: Self;

    /// The nearest value to `value`, saturating; `NaN` gives zero. Settings time only.
    fn quantise(value: f64, quantity: Quantity) -> Self;

    /// The value as `f32`, for telemetry.
    fn to_f32(self, quantity: Quantity) -> f32;

    /// The value's own bits, of 32-bit types; others become `f32`. For recordings that are read later.
    fn to_word(self) -> u32;

    /// The value of [`to_word`](Self::to_word)'s bits as `f32`. Not for the tick.
    fn word_to_f32(word: u32, quantity: Quantity) -> f32;

    /// The value as `f64`, for the host's metrics; not for the tick.
    fn to_f64(self, quantity: Quantity) -> f64;

    /// The constant that turns a signal of quantity `from` into one of quantity `to`. Settings time only.
    fn gain(value: f64, from: Quantity, to: Quantity) -> Self::Gain;

    /// This signal times a constant.
    fn scale(self, gain: Self::Gain) -> Self;

    /// An integer times a constant made from [`Quantity::Integer`].
    fn scale_integer(value: i32, gain: Self::Gain) -> Self;

    /// A wide integer times a constant made from [`Quantity::Integer`]; saturates at +-2^40 or beyond.
    fn scale_wide(value: i64, gain: Self::Gain) -> Self;

    /// This signal times a constant made to [`Quantity::Integer`], rounded to the nearest integer, saturating;
    /// `NaN` gives zero.
    fn round_scaled(self, gain: Self::Gain) -> i32;

    /// This signal times a dimensionless signal of quantity `factor_quantity`.
    fn times(self, factor: Self, factor_quantity: Quantity) -> Self;

    /// The value within `low..=high`, which must be ordered; `NaN` gives zero.
    fn limit(self, low: Self, high: Self) -> Self;

    /// True if the value is within `-most..=most`; not so of `NaN`. `most` must not be negative.
    fn is_within(self, most: Self) -> bool;

    /// The value within `-most..=most`; `NaN` gives zero. `most` must not be negative.
    #[inline(always)]
    fn within(self, most: Self) -> Self {
        if self.is_within(most) {
            self
        } else {
            cold_path();
            self.limit(-most, most)
        }
    }

    /// The magnitude of the value.
    fn magnitude(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }

    /// The interval of a logarithmic table that holds this non-negative signal, and the place within the interval as
    /// a [`Quantity::Fraction`] in `0..1`. See [`OctaveTable`](crate::table::OctaveTable) for the layout. Values
    /// beyond the table give an interval at or past its last.
    fn octave(self, start: OctaveStart<Self>) -> (usize, Self);

    /// `sum` plus this signal times a constant, saturating.
    fn accumulate(self, sum: Self::Sum, gain: Self::Gain) -> Self::Sum;

    /// The sum as a signal.
    fn total(sum: Self::Sum) -> Self;

    /// The sum that stands for this signal.
    fn into_sum(self) -> Self::Sum;
}

/// The start of a logarithmic table: the first octave's lower bound, a power of two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OctaveStart<S: Scalar> {
    /// The key (exponent and leading mantissa bits) of the interval below the first octave; negative, wrapped, when that lies
    /// below a fixed-point format's step.
    pub(crate) key: u32,
    /// Turns a signal below the first octave into a place within the first interval.
    pub(crate) below: S::Gain,
    /// The first octave's lower bound, or the format's step if that is larger.
    pub(crate) bound: S,
}

/// Intervals per octave of a logarithmic table, as a power of two: 2^4 = 16.
pub(crate) const OCTAVE_INTERVAL_BITS: u32 = 4;

impl<S: Scalar> OctaveStart<S> {
    /// The start at `2^exponent` of a signal of the given quantity. Settings time only.
    pub(crate) fn new(exponent: i32, quantity: Quantity) -> Self {
        // The first octaves of a curve over small values may lie below the step of a fixed-point format.
        let quantise = |exponent: i32| S::quantise(libm::scalbn(1.0, exponent), quantity);
        let held = (exponent..0)
            .find(|&e| quantise(e).to_f64(quantity) == libm::scalbn(1.0, e))
            .unwrap_or(exponent);
        let bound = quantise(held);
        let below = S::gain(libm::scalbn(1.0, -exponent), quantity, Quantity::Fraction);
        let origin = Self {
            key: 0,
            below,
            bound,
        };
        // Interval 1 starts at the bound, so a table based at key zero says which key the interval before it has.
        let (interval, _) = bound.octave(origin);
        let skipped = ((held - exponent) as u32) << OCTAVE_INTERVAL_BITS;
        Self {
            key: (interval as u32).wrapping_sub(1 + skipped),
            ..origin
        }
    }
}
