//! `f32` for the target and `f64` for the host. Plain IEEE operations in a fixed order: no fused multiply-add and no
//! platform library, so that host and target agree to the bit.

use crate::hint::cold_path;

use super::number::{OCTAVE_INTERVAL_BITS, OctaveStart, Scalar};
use super::quantity::Quantity;

/// A sum that keeps what its last rounding lost: terms far below its resolution still add up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensatedSum<F> {
    total: F,
    lost: F,
}

macro_rules! float_scalar {
    ($float:ty, $bits:ty, $mantissa_bits:expr, $half:expr, $place:expr) => {
        impl Scalar for $float {
            type Gain = $float;
            type Sum = CompensatedSum<$float>;

            const ZERO: Self = 0.0;

            fn quantise(value: f64, _: Quantity) -> Self {
                if value.is_nan() { 0.0 } else { value as $float }
            }

            fn to_f32(self, _: Quantity) -> f32 {
                self as f32
            }

            fn to_word(self) -> u32 {
                (self as f32).to_bits()
            }

            fn word_to_f32(word: u32, _: Quantity) -> f32 {
                f32::from_bits(word)
            }

            fn to_f64(self, _: Quantity) -> f64 {
                f64::from(self)
            }

            fn gain(value: f64, _: Quantity, _: Quantity) -> Self::Gain {
                value as $float
            }

            fn scale(self, gain: Self::Gain) -> Self {
                self * gain
            }

            fn scale_integer(value: i32, gain: Self::Gain) -> Self {
                value as $float * gain
            }

            #[inline(always)]
            fn scale_wide(value: i64, gain: Self::Gain) -> Self {
                if let Ok(value) = i32::try_from(value) {
                    return value as $float * gain;
                }
                cold_path();
                // Two halves, the lower one exact: a 64-bit conversion is a library call on the target. Their sum is rounded once,
                // as the conversion of a narrow value is.
                let high = value >> 20;
                let low = (value & 0xF_FFFF) as i32;
                let high = if high == i64::from(high as i32) {
                    high as i32
                } else if high < 0 {
                    i32::MIN
                } else {
                    i32::MAX
                };
                (high as $float * 1_048_576.0 + low as $float) * gain
            }

            fn round_scaled(self, gain: Self::Gain) -> i32 {
                let scaled = self * gain;
                let half = if scaled < 0.0 { -$half } else { $half };
                (scaled + half) as i32
            }

            fn times(self, factor: Self, _: Quantity) -> Self {
                self * factor
            }

            #[inline(always)]
            fn limit(self, low: Self, high: Self) -> Self {
                if self <= high {
                    if self >= low { self } else { low }
                } else if self > high {
                    high
                } else {
                    0.0
                }
            }

            fn is_within(self, most: Self) -> bool {
                self.magnitude() <= most
            }

            fn magnitude(self) -> Self {
                // Clears the sign bit; the same on both sides, also for NaN.
                Self::from_bits(self.to_bits() & (<$bits>::MAX >> 1))
            }

            #[inline(always)]
            fn octave(self, start: OctaveStart<Self>) -> (usize, Self) {
                if self < start.bound {
                    return (0, self * start.below);
                }
                const SHIFT: u32 = $mantissa_bits - OCTAVE_INTERVAL_BITS;
                let bits = self.to_bits();
                let interval = ((bits >> SHIFT) as u32).wrapping_sub(start.key);
                (interval as usize, $place(bits << (<$bits>::BITS - SHIFT)))
            }

            #[inline(always)]
            fn accumulate(self, sum: Self::Sum, gain: Self::Gain) -> Self::Sum {
                // Kahan's summation: what rounding takes from one sum is added to the next term.
                let term = self * gain + sum.lost;
                let total = sum.total + term;
                CompensatedSum {
                    total,
                    lost: term - (total - sum.total),
                }
            }

            fn total(sum: Self::Sum) -> Self {
                sum.total
            }

            #[inline(always)]
            fn into_sum(self) -> Self::Sum {
                CompensatedSum {
                    total: self,
                    lost: 0.0,
                }
            }
        }
    };
}

float_scalar!(f32, u32, 23, 0.5, |left: u32| left as f32 / 4_294_967_296.0);

// The host's reference; kept off the target, where a double-precision operation is a library call.
#[cfg(not(target_os = "none"))]
// Signed, as a conversion of unsigned 64 bits takes several instructions.
float_scalar!(f64, u64, 52, 0.5, |left: u64| (left >> 1) as i64 as f64
    / 9_223_372_036_854_775_808.0);
