//! The 12-bit output: exact in the mean, bounded, never out of range.

use proptest::prelude::*;
use quadrant_law::noise_shaper::{NoiseShaper, NoiseShaperState};
use quadrant_law::units::DacCode;

const ALL: [NoiseShaper; 3] = [
    NoiseShaper::Rounded,
    NoiseShaper::FirstOrder,
    NoiseShaper::SecondOrder,
];

/// The sum of what is lost, in codes: of each word and overall.
fn lost(shaper: NoiseShaper, codes: impl Iterator<Item = i16>) -> (i32, i64) {
    let mut state = NoiseShaperState::default();
    let (mut largest, mut sum) = (0, 0);
    for code in codes {
        let word = shaper.step(&mut state, DacCode(code));
        let error = i32::from(code) - 16 * i32::from(word);
        largest = largest.max(error.abs());
        sum += i64::from(error);
    }
    (largest, sum)
}

#[test]
fn every_constant_code_is_exact_in_the_mean_but_for_the_rounded() {
    // The outermost codes are beyond the largest word: 2047 x 16 = 32752.
    let mut rounded_loses = 0;
    for code in (-32_000..=32_000).step_by(7) {
        for (shaper, bound) in [(NoiseShaper::FirstOrder, 8), (NoiseShaper::SecondOrder, 16)] {
            let (_, sum) = lost(shaper, std::iter::repeat_n(code, 1_000));
            assert!(
                sum.abs() <= bound,
                "{shaper:?} loses {sum} codes in 1000 words at {code}"
            );
        }
        rounded_loses +=
            i32::from(lost(NoiseShaper::Rounded, std::iter::repeat_n(code, 1_000)).1 != 0);
    }
    assert!(
        rounded_loses > 8_000,
        "rounding loses something nearly everywhere: {rounded_loses}"
    );
}

#[test]
fn a_word_is_at_most_half_a_step_off_or_one_and_a_half_or_two() {
    for (shaper, bound) in [
        (NoiseShaper::Rounded, 8),
        (NoiseShaper::FirstOrder, 16),
        (NoiseShaper::SecondOrder, 32),
    ] {
        let codes = (0..200_000_u32)
            .map(|i| (f64::from(i) * 0.013).sin() * 30_000.0)
            .map(|v| v as i16);
        let (largest, _) = lost(shaper, codes);
        assert!(largest <= bound, "{shaper:?}: {largest}");
        assert!(largest > bound / 2 - 4, "{shaper:?}: {largest}");
    }
}

#[test]
fn after_the_end_of_the_range_it_recovers_within_three_words() {
    for shaper in ALL {
        let mut state = NoiseShaperState::default();
        for end in [i16::MAX, i16::MIN] {
            for _ in 0..10_000 {
                let word = shaper.step(&mut state, DacCode(end));
                assert!((-2048..=2047).contains(&word));
            }
            let words: Vec<i16> = (0..20)
                .map(|_| shaper.step(&mut state, DacCode(1600)))
                .collect();
            assert!(
                words[3..].iter().all(|word| (word - 100).abs() <= 2),
                "{shaper:?}: {words:?}"
            );
        }
    }
}

#[test]
fn noise_at_low_frequencies_falls_with_the_order() {
    // A slow sine, and what is lost of it below 1/50 of the sample rate: a moving mean of 50 words.
    let of = |shaper: NoiseShaper| {
        let mut state = NoiseShaperState::default();
        let errors: Vec<f64> = (0..100_000)
            .map(|i| (9_000.0 * (f64::from(i) * 1e-3).sin()) as i16)
            .map(|code| {
                f64::from(i32::from(code) - 16 * i32::from(shaper.step(&mut state, DacCode(code))))
            })
            .collect();
        let means = errors.windows(50).map(|w| w.iter().sum::<f64>() / 50.0);
        (means.clone().map(|mean| mean * mean).sum::<f64>() / means.count() as f64).sqrt()
    };
    let [rounded, first, second] = ALL.map(of);
    println!(
        "rms of the mean over 50 words, codes: {rounded:.3} rounded, {first:.3} first, {second:.3} second order"
    );
    assert!(
        first < rounded / 3.0 && second < rounded / 3.0,
        "{rounded} {first} {second}"
    );
}

proptest! {
    /// With any input: words in range, and a first-order sum that is exact to half a step.
    #[test]
    fn any_sequence_within_the_range_is_exact_in_the_sum(codes in prop::collection::vec(-32_700_i16..=32_700, 1..400)) {
        let (_, first) = lost(NoiseShaper::FirstOrder, codes.iter().copied());
        prop_assert!(first.abs() <= 8, "{first}");
        let (_, second) = lost(NoiseShaper::SecondOrder, codes.iter().copied());
        prop_assert!(second.abs() <= 64, "{second}");
    }

    /// The whole range of codes, ends included, in any order: never out of range, never a panic.
    #[test]
    fn no_sequence_leaves_the_range(codes in prop::collection::vec(any::<i16>(), 1..400)) {
        for shaper in ALL {
            let mut state = NoiseShaperState::default();
            for code in &codes {
                let word = shaper.step(&mut state, DacCode(*code));
                prop_assert!((-2048..=2047).contains(&word));
                prop_assert!((i32::from(*code) - 16 * i32::from(word)).abs() <= 64);
            }
        }
    }
}
