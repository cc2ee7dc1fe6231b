//! 32-bit fixed point for a machine without a floating-point unit.

use core::ops::{Add, Neg, Sub};

use super::number::{OCTAVE_INTERVAL_BITS, OctaveStart, Scalar};
use super::quantity::Quantity;
use crate::law::rounding;

/// A saturating 32-bit number. The binary point is the [`Quantity`]'s, known to the code that holds the value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Fixed(pub i32);

/// A constant as a normalised mantissa and a shift, `mantissa * 2^-shift`: 31 significant bits whatever its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FixedGain {
    mantissa: i32,
    shift: u32,
}

/// Fraction bits that a [`Scalar::Sum`] of [`Fixed`] has beyond its signal's.
const SUM_EXTRA_BITS: u32 = 32;

/// A shift past which a product of two 32-bit numbers has nothing left.
const LARGEST_SHIFT: u32 = 62;

const fn saturate(value: i64) -> Fixed {
    if value > i32::MAX as i64 {
        Fixed(i32::MAX)
    } else if value < i32::MIN as i64 {
        Fixed(i32::MIN)
    } else {
        Fixed(value as i32)
    }
}

/// `value / 2^shift`, rounded to the nearest.
#[inline(always)]
const fn round_shift(value: i64, shift: u32) -> i64 {
    if shift == 0 {
        value
    } else {
        value.saturating_add(1 << (shift - 1)) >> shift
    }
}

impl Add for Fixed {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Fixed {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Fixed {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl FixedGain {
    /// The product with a 32-bit signal, before rounding: never overflows.
    #[inline(always)]
    const fn product(self, value: i32) -> i64 {
        value as i64 * self.mantissa as i64
    }
}

impl Scalar for Fixed {
    type Gain = FixedGain;
    type Sum = i64;

    const ZERO: Self = Self(0);

    fn quantise(value: f64, quantity: Quantity) -> Self {
        let scaled = value * libm::scalbn(1.0, quantity.fraction_bits() as i32);
        // `as` saturates and turns NaN into zero.
        Self(rounding::round(scaled) as i32)
    }

    fn to_f32(self, quantity: Quantity) -> f32 {
        self.0 as f32 * (1.0 / (1u32 << quantity.fraction_bits()) as f32)
    }

    fn to_f64(self, quantity: Quantity) -> f64 {
        f64::from(self.0) / f64::from(1u32 << quantity.fraction_bits())
    }

    fn gain(value: f64, from: Quantity, to: Quantity) -> FixedGain {
        let exponent = to.fraction_bits() as i32 - from.fraction_bits() as i32;
        let (fraction, power) = libm::frexp(libm::scalbn(value, exponent));
        // fraction is in 0.5..1: 2^31 of it would not fit, 2^30 does with the sign.
        let shift = 30 - power;
        let (mantissa, shift) = if fraction == 0.0 || !fraction.is_finite() {
            (0.0, 0)
        } else if shift < 0 {
            (f64::from(i32::MAX).copysign(fraction), 0)
        } else if shift > LARGEST_SHIFT as i32 {
            let excess = LARGEST_SHIFT as i32 - shift;
            (libm::scalbn(fraction, 30 + excess), LARGEST_SHIFT as i32)
        } else {
            (libm::scalbn(fraction, 30), shift)
        };
        FixedGain {
            mantissa: rounding::round(mantissa) as i32,
            shift: shift as u32,
        }
    }

    #[inline(always)]
    fn scale(self, gain: FixedGain) -> Self {
        Self::scale_integer(self.0, gain)
    }

    #[inline(always)]
    fn scale_integer(value: i32, gain: FixedGain) -> Self {
        saturate(round_shift(gain.product(value), gain.shift))
    }

    #[inline(always)]
    fn scale_wide(value: i64, gain: FixedGain) -> Self {
        const LIMIT: i64 = (1 << 40) - 1;
        let value = value.clamp(-LIMIT, LIMIT);
        // 40 bits of value and 23 of mantissa fit 64; the last 7 bits of the mantissa weigh 1e-7 of a position error.
        const DROPPED: u32 = 8;
        let mantissa = i64::from(gain.mantissa >> DROPPED);
        let product = value * mantissa;
        if gain.shift >= DROPPED {
            saturate(round_shift(product, gain.shift - DROPPED))
        } else {
            saturate(product.saturating_mul(1 << (DROPPED - gain.shift)))
        }
    }

    #[inline(always)]
    fn round_scaled(self, gain: FixedGain) -> i32 {
        self.scale(gain).0
    }

    #[inline(always)]
    fn times(self, factor: Self, factor_quantity: Quantity) -> Self {
        let product = i64::from(self.0) * i64::from(factor.0);
        saturate(round_shift(product, factor_quantity.fraction_bits()))
    }

    #[inline(always)]
    fn limit(self, low: Self, high: Self) -> Self {
        if self > high {
            high
        } else if self < low {
            low
        } else {
            self
        }
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        Self(self.0.saturating_abs())
    }

    #[inline(always)]
    fn octave(self, start: OctaveStart<Self>) -> (usize, Self) {
        if self < start.bound || self.0 <= 0 {
            return (0, self.scale(start.below));
        }
        let leading = self.0.leading_zeros();
        // The leading one at bit 31: the exponent above, the interval in the next bits, the place in the rest.
        let normal = (self.0 as u32) << leading;
        let exponent = 31 - leading;
        let key = (exponent << OCTAVE_INTERVAL_BITS)
            | ((normal >> (31 - OCTAVE_INTERVAL_BITS)) & ((1 << OCTAVE_INTERVAL_BITS) - 1));
        let place = (normal << (1 + OCTAVE_INTERVAL_BITS)) >> 2;
        (key.wrapping_sub(start.key) as usize + 1, Self(place as i32))
    }

    #[inline(always)]
    fn accumulate(self, sum: i64, gain: FixedGain) -> i64 {
        let product = gain.product(self.0);
        let term = if gain.shift >= SUM_EXTRA_BITS {
            round_shift(product, gain.shift - SUM_EXTRA_BITS)
        } else {
            product.saturating_mul(1 << (SUM_EXTRA_BITS - gain.shift))
        };
        sum.saturating_add(term)
    }

    #[inline(always)]
    fn total(sum: i64) -> Self {
        saturate(round_shift(sum, SUM_EXTRA_BITS))
    }

    #[inline(always)]
    fn into_sum(self) -> i64 {
        i64::from(self.0) << SUM_EXTRA_BITS
    }
}
