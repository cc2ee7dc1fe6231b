//! 32-bit fixed point for a machine without a floating-point unit.

use crate::hint::cold_path;
use core::ops::{Add, Neg, Sub};

use super::number::{OCTAVE_INTERVAL_BITS, OctaveStart, Scalar};
use super::quantity::Quantity;
use crate::rounding;

/// A saturating 32-bit number. The binary point is the [`Quantity`]'s, known to the code that holds the value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Fixed(pub i32);

/// A constant as a normalised mantissa and a shift, `mantissa * 2^-shift`: 31 significant bits at any size. Zero by
/// default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedGain {
    mantissa: i32,
    /// `shift - 33`, wrapped: 0 and above shift the upper half of a product to the right, and the bit that rounds is left. Of
    /// what is below, the complement shifts the signal to the left.
    right: u32,
}

impl Default for FixedGain {
    fn default() -> Self {
        Self::new(0, LARGEST_SHIFT)
    }
}

/// Fraction bits that a [`Scalar::Sum`] of [`Fixed`] has beyond its signal's.
const SUM_EXTRA_BITS: u32 = 32;

/// A shift past which a product of two 32-bit numbers has nothing left.
const LARGEST_SHIFT: u32 = 62;

#[inline(always)]
const fn saturate(value: i64) -> Fixed {
    let low = value as i32;
    if low as i64 == value {
        return Fixed(low);
    }
    cold_path();
    Fixed(if value < 0 { i32::MIN } else { i32::MAX })
}

/// `value / 2^shift`, rounded to the nearest.
#[inline(always)]
const fn round_shift(value: i64, shift: u32) -> i64 {
    if shift == 0 {
        value
    } else {
        // As the sum of the value and a half, but that cannot overflow.
        ((value >> (shift - 1)) + 1) >> 1
    }
}

/// The number `value / 2^fraction_bits`, rounded to even as a conversion in hardware does, where there is no such hardware.
#[inline(always)]
const fn to_float(value: i32, fraction_bits: u32) -> f32 {
    const MANTISSA_BITS: u32 = f32::MANTISSA_DIGITS - 1;
    const BIAS: u32 = 127;
    if value == 0 {
        return 0.0;
    }
    let size = value.unsigned_abs();
    let leading = size.leading_zeros();
    // The leading one at bit 31, and below the mantissa what is rounded.
    let normal = size << leading;
    let (mantissa, rest) = (normal >> 8, normal & 0xFF);
    let up = rest + (mantissa & 1) > 0x80;
    // The leading one adds the one that the exponent lacks, and a carry out of the mantissa another.
    let exponent = BIAS + 30 - leading - fraction_bits;
    let sign = value as u32 & 1 << 31;
    f32::from_bits(sign | ((exponent << MANTISSA_BITS) + mantissa + up as u32))
}

impl Add for Fixed {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Fixed {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Fixed {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl FixedGain {
    const fn new(mantissa: i32, shift: u32) -> Self {
        Self {
            mantissa,
            right: shift.wrapping_sub(u32::BITS + 1),
        }
    }

    const fn shift(self) -> u32 {
        self.right.wrapping_add(u32::BITS + 1)
    }

    /// The product with a 32-bit signal, before rounding: never overflows.
    const fn product(self, value: i32) -> i64 {
        value as i64 * self.mantissa as i64
    }

    /// The product with a 32-bit signal, rounded to the nearest, saturating.
    #[inline(always)]
    const fn scaled(self, value: i32) -> Fixed {
        if self.right < u32::BITS {
            // The lower half of the product is less than the half that rounds, so its upper half is enough.
            let upper = (self.product(value) >> u32::BITS) as i32;
            Fixed(((upper >> self.right) + 1) >> 1)
        } else {
            shifted_product(value, self.mantissa, !self.right)
        }
    }
}

/// `value * factor / 2^(32 - left)`, rounded to the nearest, saturating; `left` is 32 at most.
#[inline(always)]
const fn shifted_product(value: i32, factor: i32, left: u32) -> Fixed {
    // Shifted to the left first, where there is room, so that the upper half of the product is the result, which then fits.
    if left < u32::BITS && (value << left) >> left == value {
        let product = (value << left) as i64 * factor as i64;
        return Fixed((product >> u32::BITS) as i32 + (product as u32 >> 31) as i32);
    }
    cold_path();
    saturate(round_shift(value as i64 * factor as i64, u32::BITS - left))
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
        to_float(self.0, quantity.fraction_bits())
    }

    fn to_word(self) -> u32 {
        self.0 as u32
    }

    fn word_to_f32(word: u32, quantity: Quantity) -> f32 {
        Self(word as i32).to_f32(quantity)
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
            (0.0, LARGEST_SHIFT as i32)
        } else if shift < 0 {
            (f64::from(i32::MAX).copysign(fraction), 0)
        } else if shift > LARGEST_SHIFT as i32 {
            let excess = LARGEST_SHIFT as i32 - shift;
            (libm::scalbn(fraction, 30 + excess), LARGEST_SHIFT as i32)
        } else {
            (libm::scalbn(fraction, 30), shift)
        };
        FixedGain::new(rounding::round(mantissa) as i32, shift as u32)
    }

    fn scale(self, gain: FixedGain) -> Self {
        Self::scale_integer(self.0, gain)
    }

    fn scale_integer(value: i32, gain: FixedGain) -> Self {
        gain.scaled(value)
    }

    #[inline(always)]
    fn scale_wide(value: i64, gain: FixedGain) -> Self {
        const LIMIT: i64 = (1 << 40) - 1;
        // 40 bits of value and 23 of mantissa fit 64; the last 7 bits of the mantissa weigh 1e-7 of a position error.
        const DROPPED: u32 = 8;
        let shift = gain.shift();
        if let Ok(value) = i32::try_from(value)
            && shift >= DROPPED
        {
            return FixedGain::new(gain.mantissa >> DROPPED, shift - DROPPED).scaled(value);
        }
        cold_path();
        let value = value.clamp(-LIMIT, LIMIT);
        let mantissa = i64::from(gain.mantissa >> DROPPED);
        let product = value * mantissa;
        if shift >= DROPPED {
            saturate(round_shift(product, shift - DROPPED))
        } else {
            saturate(product.saturating_mul(1 << (DROPPED - shift)))
        }
    }

    fn round_scaled(self, gain: FixedGain) -> i32 {
        self.scale(gain).0
    }

    fn times(self, factor: Self, factor_quantity: Quantity) -> Self {
        let left = u32::BITS - factor_quantity.fraction_bits();
        shifted_product(self.0, factor.0, left)
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

    fn is_within(self, most: Self) -> bool {
        // One comparison of an unsigned difference.
        self.0.wrapping_add(most.0) as u32 <= (most.0 as u32) << 1
    }

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
        (key.wrapping_sub(start.key) as usize, Self(place as i32))
    }

    #[inline(always)]
    fn accumulate(self, sum: i64, gain: FixedGain) -> i64 {
        let product = gain.product(self.0);
        let term = if gain.right < u32::BITS {
            // As `round_shift` does, but each half by itself: a shift of both by an unknown number asks whether it is above 31.
            let (lower, upper) = (product as u32, (product >> u32::BITS) as i32);
            let lower = lower >> gain.right | ((upper << 1) << (31 - gain.right)) as u32;
            let upper = upper >> gain.right;
            ((i64::from(upper) << u32::BITS | i64::from(lower)) + 1) >> 1
        } else {
            cold_path();
            product.saturating_mul(1 << (SUM_EXTRA_BITS - gain.shift()))
        };
        sum.saturating_add(term)
    }

    fn total(sum: i64) -> Self {
        saturate(round_shift(sum, SUM_EXTRA_BITS))
    }

    fn into_sum(self) -> i64 {
        i64::from(self.0) << SUM_EXTRA_BITS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_float_is_that_of_a_conversion_and_a_division() {
        let exact = |value: i32, bits: u32| value as f32 * (1.0 / (1u32 << bits) as f32);
        let mut value = 1i32;
        for step in 0..2_000_000 {
            value = value.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            for value in [value, value >> (step % 31), i32::MIN, i32::MAX, 0, -1] {
                for bits in [0, 16, 20, 26, 30] {
                    assert_eq!(
                        to_float(value, bits).to_bits(),
                        exact(value, bits).to_bits()
                    );
                }
            }
        }
    }

    /// Calls with many values, gains of every shift, and the number of the draw.
    fn with_gains(mut check: impl FnMut(i32, FixedGain, u32)) {
        let mut value = 1i32;
        for step in 0..300_000 {
            value = value.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let mantissa = value.rotate_left(7) >> 1;
            for shift in 0..=LARGEST_SHIFT {
                let gain = FixedGain::new(mantissa, shift);
                for value in [value, value >> (step % 31), i32::MIN, i32::MAX] {
                    check(value, gain, step);
                }
            }
        }
    }

    #[test]
    fn a_product_is_rounded_as_a_wide_one_is() {
        let wide = |value: i32, gain: FixedGain| {
            let product = i128::from(value) * i128::from(gain.mantissa);
            let half = (1i128 << gain.shift()) >> 1;
            let rounded = (product + half) >> gain.shift();
            rounded.clamp(i32::MIN.into(), i32::MAX.into()) as i32
        };
        with_gains(|value, gain, _| assert_eq!(gain.scaled(value).0, wide(value, gain)));
    }

    #[test]
    fn a_sum_takes_a_product_rounded_as_a_wide_one_is() {
        let wide = |value: i32, gain: FixedGain, sum: i64| {
            let product = (i128::from(value) * i128::from(gain.mantissa)) << SUM_EXTRA_BITS;
            let half = (1i128 << gain.shift()) >> 1;
            let term = (product + half) >> gain.shift();
            let term = term.clamp(i64::MIN.into(), i64::MAX.into());
            (i128::from(sum) + term).clamp(i64::MIN.into(), i64::MAX.into()) as i64
        };
        with_gains(|value, gain, step| {
            let sum = i64::from(value.rotate_left(3)) << (step % 32);
            assert_eq!(Fixed(value).accumulate(sum, gain), wide(value, gain, sum));
        });
    }
}
