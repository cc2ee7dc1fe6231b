//! k(e) = cosh(ko sat(e, emax)) and its table.

use proptest::prelude::*;
use quadrant_law::control::npid::{NonlinearGain, NonlinearGainTable};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};

use quadrant_test_support::repeatable;

/// Every gain that validation accepts.
fn gains() -> impl Strategy<Value = NonlinearGain> {
    (-3.0f64..1.0, 0.0f64..=3.4).prop_map(|(log_range, steepness)| {
        let range_mm = 10f64.powf(log_range);
        NonlinearGain {
            rate_per_mm: steepness / range_mm,
            range_mm,
        }
    })
}

/// The stated bound of the table's error: chords of a convex curve over intervals of at most a sixteenth of their
/// argument, and the rounding of the number type.
fn bound(gain: &NonlinearGain, rounding: f64) -> f64 {
    let steepness = gain.rate_per_mm * gain.range_mm;
    (steepness / 16.0).powi(2) / 8.0 * (steepness * 17.0 / 16.0).cosh() + rounding
}

fn check<S: Scalar>(
    gain: &NonlinearGain,
    error_mm: f64,
    rounding: f64,
) -> Result<(), TestCaseError> {
    let table = NonlinearGainTable::<S>::build(gain);
    let error = S::quantise(error_mm, Quantity::Length);
    let k = table.at(error);
    prop_assert_eq!(k, table.at(-error), "even");
    let (value, largest) = (k.to_f64(Quantity::Multiplier), gain.largest());
    prop_assert!(value >= 1.0, "k({error_mm}) = {value}");
    prop_assert!(value <= S::quantise(largest, Quantity::Multiplier).to_f64(Quantity::Multiplier));
    // The formula at the error that the number type holds.
    let exact = gain.at(error.to_f64(Quantity::Length));
    let most = bound(gain, rounding * exact);
    prop_assert!((value - exact).abs() <= most, "{value} {exact} {most}");
    Ok(())
}

proptest! {
    #![proptest_config(repeatable(2000))]

    #[test]
    fn k_is_even_within_its_bounds_and_near_the_formula(gain in gains(), place in -3.0f64..3.0) {
        let error = place * gain.range_mm;
        check::<f64>(&gain, error, 1e-14)?;
        check::<f32>(&gain, error, 1e-6)?;
        check::<Fixed>(&gain, error, 1e-6)?;
    }

    #[test]
    fn k_grows_with_the_error(gain in gains(), place in 0.0f64..1.2, more in 1e-4f64..0.1) {
        let table = NonlinearGainTable::<f32>::build(&gain);
        let low = table.at((place * gain.range_mm) as f32);
        let high = table.at(((place + more) * gain.range_mm) as f32);
        prop_assert!(low <= high);
    }
}

#[test]
fn k_of_no_error_is_exactly_one() {
    let gain = NonlinearGain {
        rate_per_mm: 15.0,
        range_mm: 0.1,
    };
    assert_eq!(NonlinearGainTable::<f64>::build(&gain).at(0.0), 1.0);
    assert_eq!(NonlinearGainTable::<f32>::build(&gain).at(0.0), 1.0);
    assert_eq!(NonlinearGainTable::<f32>::build(&gain).at(-0.0), 1.0);
    let one = Fixed::quantise(1.0, Quantity::Multiplier);
    let table = NonlinearGainTable::<Fixed>::build(&gain);
    assert_eq!(table.at(Fixed::ZERO), one);
}

#[test]
fn default_table_errs_by_less_than_a_tenth_of_a_percent() {
    let gain = NonlinearGain {
        rate_per_mm: 15.0,
        range_mm: 0.1,
    };
    let table = NonlinearGainTable::<f64>::build(&gain);
    let mut worst: f64 = 0.0;
    for step in 0..=200_000 {
        let error = f64::from(step) * 1e-6;
        worst = worst.max((table.at(error) / gain.at(error) - 1.0).abs());
    }
    println!("worst relative error of k(e): {worst:.2e}");
    assert!(worst < 1e-3, "{worst:.2e}");
    assert!(worst > 1e-6, "the table is not the formula: {worst:.2e}");
}

#[test]
fn k_beyond_its_range_is_the_largest() {
    let gain = NonlinearGain {
        rate_per_mm: 15.0,
        range_mm: 0.1,
    };
    let table = NonlinearGainTable::<f32>::build(&gain);
    let largest = gain.largest() as f32;
    for error in [0.1f32, 0.11, 1.0, 1e30, f32::INFINITY] {
        assert_eq!(table.at(error), largest);
        assert_eq!(table.at(-error), largest);
    }
}

#[test]
fn scaled_error_is_the_gain_times_the_error() {
    let gain = NonlinearGain {
        rate_per_mm: 15.0,
        range_mm: 0.1,
    };
    let table = NonlinearGainTable::<f64>::build(&gain);
    for error in [-0.2, -0.05, 0.0, 1e-4, 0.09, 3.0] {
        assert_eq!(table.scaled_error(error), error * table.at(error));
    }
}
