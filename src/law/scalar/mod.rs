//! The number type of the control law.
//!
//! The law is written once, over [`Scalar`], and runs on three number types: `f32` on a target with a floating-point
//! unit, [`Fixed`] on one without, and `f64` on the host, where it is the reference that numeric error is measured
//! against and the arithmetic of the simulated plant.
//!
//! Signals are `S`, a value together with a [`Quantity`] that the code knows and the number does not carry. For the
//! floats the quantity changes nothing. For [`Fixed`] it picks the binary point. A constant that multiplies a signal
//! is an `S::Gain`, made at settings time from its value in `f64` and the quantities on both sides, so that no
//! format is converted, and nothing is divided, in the tick.
//!
//! Every operation saturates, none wraps, and none panics.

mod fixed;
mod float;

pub use fixed::{Fixed, FixedGain};
pub use float::CompensatedSum;

use core::fmt::Debug;
use core::ops::{Add, Neg, Sub};

/// What a signal measures. In fixed point each has its own format; `docs/fixed-point.md` holds the range analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Tracking error and displacement in a tick, mm. Fixed: Q5.26, +-32 mm in steps of 0.015 nm.
    Length,
    /// Reference velocity, mm/s. Fixed: Q11.20, +-2048 mm/s in steps of 0.95 nm/s.
    Velocity,
    /// Reference acceleration, mm/s^2. Fixed: Q15.16, +-32 m/s^2 in steps of 15 nm/s^2.
    Acceleration,
    /// Voltage at the amplifier input, V. Fixed: Q5.26, +-32 V in steps of 15 nV.
    Voltage,
    /// A ratio within +-1, such as a decay per tick or a place within a table's interval. Fixed: Q1.30.
    Fraction,
    /// A ratio that may exceed 1, such as k(e). Fixed: Q5.26.
    Multiplier,
    /// A raw integer: counts, [`Position`](crate::law::units::Position) units, DAC codes. Fixed: Q31.0.
    Integer,
}

impl Quantity {
    /// Number of fraction bits of the fixed-point format.
    pub const fn fraction_bits(self) -> u32 {
        match self {
            Self::Length | Self::Voltage | Self::Multiplier => 26,
            Self::Velocity => 20,
            Self::Acceleration => 16,
            Self::Fraction => 30,
            Self::Integer => 0,
        }
    }

    /// The largest magnitude that the fixed-point format holds.
    pub fn limit(self) -> f64 {
        i32::MAX as f64 / (1u64 << self.fraction_bits()) as f64
    }
}

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

    /// The magnitude.
    fn magnitude(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }

    /// The interval of a logarithmic table that holds this non-negative signal, and the place within the interval as
    /// a [`Quantity::Fraction`] in `0..1`. See [`OctaveTable`](crate::law::table::OctaveTable) for the layout. Values
    /// beyond the table give an interval at or past its last.
    fn octave(self, start: OctaveStart<Self>) -> (usize, Self);

    /// `sum` plus this signal times a constant, saturating.
    fn accumulate(self, sum: Self::Sum, gain: Self::Gain) -> Self::Sum;

    /// The sum as a signal.
    fn total(sum: Self::Sum) -> Self;

    /// The sum that stands for this signal.
    fn into_sum(self) -> Self::Sum;
}

/// Where a logarithmic table starts: the first octave's lower bound, a power of two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OctaveStart<S: Scalar> {
    /// The key (exponent and leading mantissa bits) of the first octave's lower bound; negative, wrapped, when that lies
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
        // Interval 1 starts at the bound, so a table based at key zero says which key the bound has.
        let (interval, _) = bound.octave(origin);
        let skipped = ((held - exponent) as u32) << OCTAVE_INTERVAL_BITS;
        Self {
            key: (interval as u32 - 1).wrapping_sub(skipped),
            ..origin
        }
    }
}
