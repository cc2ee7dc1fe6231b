//! Sine and cosine of an integer phase in integer arithmetic: the same on every machine, and exact enough that a
//! position reference errs by picometres.

/// `sin(pi/2 z) / z` in powers of `t = z^2 - 1/2`, a Chebyshev fit over -1/2..=1/2, exact to 3e-11 before rounding.
///
/// A value that lies beside the motion in memory: there a coefficient takes one instruction to load, as a constant of the
/// program two.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SinePolynomial {
    /// The constant coefficient, with 61 fraction bits.
    constant: i64,
    /// The others. Each has two fraction bits more than the one before, from 31 for that of `t`: then a step of Horner's
    /// scheme is the upper half of one product, one instruction with the sum.
    coefficients: [i32; 5],
}
/// One half, with the 30 fraction bits of the square.
const HALF: i32 = 1 << 29;

/// The upper half of a product.
fn upper(a: i32, b: i32) -> i32 {
    ((i64::from(a) * i64::from(b)) >> 32) as i32
}

/// Fraction bits of a sine.
pub(crate) const SINE_BITS: u32 = 30;

impl SinePolynomial {
    /// The only one.
    pub(crate) const FIT: Self = Self {
        constant: 2_921_876_942_130_950_361,
        coefficients: [
            -1_223_429_338,
            626_259_569,
            -150_142_711,
            20_846_069,
            -1_886_646,
        ],
    };

    /// The sine of a phase (a turn is 2^32) in units of 2^-30; the error is below 3e-9.
    #[inline(always)]
    pub(super) fn sine(&self, phase: u32) -> i32 {
        // z in quarter turns, Q31. The second and third quarters mirror the others.
        let doubled = (phase << 1) as i32;
        let z = if (phase ^ (phase << 1)) >> 31 == 0 {
            doubled
        } else {
            doubled.saturating_neg()
        };
        let t = upper(z, z) - HALF;
        let [first, second, third, fourth, fifth] = self.coefficients;
        let mut sum = fifth;
        for coefficient in [fourth, third, second, first] {
            sum = coefficient + upper(sum, t);
        }
        let slope = ((self.constant + i64::from(sum) * i64::from(t)) >> 31) as i32;
        ((i64::from(z) * i64::from(slope)) >> 31) as i32
    }

    /// The sine and the cosine of a phase.
    // Not inlined: the coefficients fit the registers of a function of its own.
    #[inline(never)]
    pub(crate) fn sine_and_cosine(&self, phase: u32) -> (i32, i32) {
        (self.sine(phase), self.sine(phase.wrapping_add(1 << 30)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(phase: u32) -> i32 {
        SinePolynomial::FIT.sine(phase)
    }

    #[test]
    fn sine_and_cosine_are_exact_to_3e_9_of_full_scale() {
        let scale = 1.0 / f64::from(1u32 << SINE_BITS);
        let turn = core::f64::consts::TAU / 4_294_967_296.0;
        for step in 0..2_000_000u32 {
            let phase = step.wrapping_mul(2_147_483_659 / 7);
            let angle = f64::from(phase) * turn;
            assert!((f64::from(sine(phase)) * scale - libm::sin(angle)).abs() < 3e-9);
            let (_, cosine) = SinePolynomial::FIT.sine_and_cosine(phase);
            assert!((f64::from(cosine) * scale - libm::cos(angle)).abs() < 3e-9);
        }
    }

    #[test]
    fn sine_is_continuous_across_its_crests() {
        for crest in [1u32 << 30, 3 << 30] {
            let mut last = sine(crest - 2000);
            for phase in crest - 2000..crest + 2000 {
                let value = sine(phase);
                assert!(
                    value.abs_diff(last) < 16,
                    "at {phase:#x}: {last} to {value}"
                );
                last = value;
            }
        }
    }

    #[test]
    fn sine_does_not_pass_full_scale() {
        for crest in [1u32 << 30, 3 << 30] {
            for phase in crest - 100_000..crest + 100_000 {
                assert!(sine(phase).abs() <= 1 << SINE_BITS);
            }
        }
        assert_eq!(sine(0), 0);
    }
}
