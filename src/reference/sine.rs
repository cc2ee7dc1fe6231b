//! Sine and cosine of an integer phase in integer arithmetic: the same on every machine, and exact enough that a
//! position reference errs by picometres.

/// `sin(pi/2 z) / z` in powers of `z^2`, Q30: a Chebyshev fit over 0..=1, exact to 3e-11 before rounding.
const COEFFICIENTS: [i64; 6] = [
    1_686_629_713,
    -693_598_666,
    85_569_282,
    -5_026_892,
    172_072,
    -3_685,
];

/// The sine of a phase (a turn is 2^32) in units of 2^-31; the error is below 3e-9.
#[inline(always)]
pub(super) fn sine(phase: u32) -> i32 {
    // z in quarter turns, Q31. The second and third quarters mirror the others.
    let doubled = (phase << 1) as i32;
    let z = if (phase ^ (phase << 1)) >> 31 == 0 {
        doubled
    } else {
        doubled.saturating_neg()
    };
    let z = i64::from(z);
    let square = (z * z) >> 31;
    let mut sum = 0;
    for coefficient in COEFFICIENTS.iter().rev() {
        sum = coefficient + ((sum * square + (1 << 30)) >> 31);
    }
    let value = (z * sum + (1 << 29)) >> 30;
    // Rounding can pass full scale by a few units at the crests.
    value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// The cosine of a phase, as [`sine`].
#[inline(always)]
pub(super) fn cosine(phase: u32) -> i32 {
    sine(phase.wrapping_add(1 << 30))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_exact_to_3e_9_of_full_scale() {
        let scale = 1.0 / f64::from(1u32 << 31);
        let turn = core::f64::consts::TAU / 4_294_967_296.0;
        for step in 0..2_000_000u32 {
            let phase = step.wrapping_mul(2_147_483_659 / 7);
            let angle = f64::from(phase) * turn;
            assert!((f64::from(sine(phase)) * scale - libm::sin(angle)).abs() < 3e-9);
            assert!((f64::from(cosine(phase)) * scale - libm::cos(angle)).abs() < 3e-9);
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
    fn sine_saturates_at_the_top_of_the_wave_instead_of_wrapping() {
        assert_eq!(sine(1 << 30), i32::MAX);
        assert_eq!(sine(3 << 30), i32::MIN);
        assert_eq!(sine(0), 0);
    }
}
