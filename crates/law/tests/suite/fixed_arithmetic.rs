//! Fixed point: saturating arithmetic and accurate gains.

use proptest::prelude::*;
use quadrant_law::scalar::{Fixed, FixedGain, Quantity, Scalar};

use quadrant_test_support::repeatable;

const QUANTITIES: [Quantity; 7] = [
    Quantity::Length,
    Quantity::Velocity,
    Quantity::Acceleration,
    Quantity::Voltage,
    Quantity::Fraction,
    Quantity::Multiplier,
    Quantity::Integer,
];

fn quantity() -> impl Strategy<Value = Quantity> {
    prop::sample::select(QUANTITIES.to_vec())
}

/// Every 32-bit number, the ends more often than chance would have it.
fn raw() -> impl Strategy<Value = i32> {
    prop_oneof![
        4 => any::<i32>(),
        1 => prop::sample::select(vec![i32::MIN, i32::MIN + 1, -1, 0, 1, i32::MAX]),
    ]
}

/// Every number that a gain can be made from.
fn gain_value() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => (-60.0f64..60.0, any::<bool>())
            .prop_map(|(log, negative)| log.exp2() * if negative { -1.0 } else { 1.0 }),
        1 => any::<f64>(),
        1 => prop::sample::select(vec![0.0, -0.0, f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE]),
    ]
}

fn clamp(exact: f64) -> f64 {
    exact.clamp(f64::from(i32::MIN), f64::from(i32::MAX))
}

/// The product that a gain should give, of raw numbers, or nothing if the gain's number is outside its range.
fn product(value: f64, gain: f64, from: Quantity, to: Quantity) -> Option<f64> {
    let scale = f64::from(to.fraction_bits()) - f64::from(from.fraction_bits());
    let raw_gain = gain * scale.exp2();
    let in_range =
        raw_gain.is_finite() && (2f64.powi(-32)..2f64.powi(30)).contains(&raw_gain.abs());
    in_range.then_some(value * raw_gain)
}

proptest! {
    #![proptest_config(repeatable(5000))]

    #[test]
    fn sums_and_signs_saturate(a in raw(), b in raw()) {
        let (wide_a, wide_b) = (f64::from(a), f64::from(b));
        let (a, b) = (Fixed(a), Fixed(b));
        prop_assert_eq!(f64::from((a + b).0), clamp(wide_a + wide_b));
        prop_assert_eq!(f64::from((a - b).0), clamp(wide_a - wide_b));
        prop_assert_eq!(f64::from((-a).0), clamp(-wide_a));
        prop_assert_eq!(f64::from(a.magnitude().0), clamp(wide_a.abs()));
        let (low, high) = if b < -b { (b, -b) } else { (-b, b) };
        prop_assert!(a.limit(low, high) >= low && a.limit(low, high) <= high);
        let most = b.magnitude();
        prop_assert_eq!(a.is_within(most), wide_a.abs() <= wide_b.abs().min(f64::from(i32::MAX)));
        prop_assert_eq!(a.within(most), a.limit(-most, most));
    }

    #[test]
    fn products_saturate_and_round_to_the_nearest(a in raw(), b in raw(), quantity in quantity()) {
        let exact = f64::from(a) * f64::from(b) / f64::from(quantity.fraction_bits()).exp2();
        let product = f64::from(Fixed(a).times(Fixed(b), quantity).0);
        prop_assert!((product - clamp(exact)).abs() <= 0.5 + 1e-6, "{product} {exact}");
    }

    #[test]
    fn scaling_saturates_and_rounds_for_any_gain(
        value in raw(),
        gain in gain_value(),
        from in quantity(),
        to in quantity(),
    ) {
        let made = Fixed::gain(gain, from, to);
        let scaled = f64::from(Fixed(value).scale(made).0);
        prop_assert_eq!(Fixed::scale_integer(value, made), Fixed(value).scale(made));
        prop_assert_eq!(Fixed(value).round_scaled(made), Fixed(value).scale(made).0);
        if let Some(exact) = product(f64::from(value), gain, from, to) {
            let most = 0.5 + exact.abs() * 2f64.powi(-29);
            prop_assert!((scaled - clamp(exact)).abs() <= most, "{scaled} {exact}");
        }
    }

    #[test]
    fn wide_scaling_saturates_and_keeps_22_bits_of_the_gain(
        value in prop_oneof![any::<i64>(), -(1i64 << 40)..1 << 40],
        gain in gain_value(),
        to in quantity(),
    ) {
        let made = Fixed::gain(gain, Quantity::Integer, to);
        let scaled = f64::from(Fixed::scale_wide(value, made).0);
        let clipped = value.clamp(-(1 << 40), 1 << 40) as f64;
        if let Some(exact) = product(clipped, gain, Quantity::Integer, to) {
            let most = 0.5 + exact.abs() * 2f64.powi(-21);
            prop_assert!((scaled - clamp(exact)).abs() <= most, "{scaled} {exact}");
        }
    }

    #[test]
    fn sums_over_ticks_saturate(start in any::<i64>(), value in raw(), gain in gain_value()) {
        let gain = Fixed::gain(gain, Quantity::Length, Quantity::Voltage);
        let sum = Fixed(value).accumulate(start, gain);
        let term = Fixed(value).accumulate(0, gain);
        prop_assert_eq!(sum, start.saturating_add(term));
        // The total is the sum without its extra bits, to the nearest.
        let total = f64::from(Fixed::total(sum).0);
        prop_assert!((total - clamp(sum as f64 / 2f64.powi(32))).abs() <= 0.5 + 1e-6);
        prop_assert_eq!(Fixed::total(Fixed(value).into_sum()), Fixed(value));
    }

    #[test]
    fn a_gain_is_exact_to_2_to_the_minus_29(log in -31.0f64..29.0, negative in any::<bool>()) {
        let value = log.exp2() * if negative { -1.0 } else { 1.0 };
        let gain = Fixed::gain(value, Quantity::Integer, Quantity::Integer);
        // Large operands show the gain itself: the sum's 32 extra bits hold the product before rounding.
        let operand = if log > 0.0 { 1 } else { 1 << 30 };
        let sum = Fixed(operand).accumulate(0, gain);
        let exact = value * f64::from(operand) * 2f64.powi(32);
        prop_assert!((sum as f64 / exact - 1.0).abs() < 2f64.powi(-29), "{sum} {exact}");
    }

    #[test]
    fn quantising_saturates_and_rounds_to_the_nearest(value in gain_value(), quantity in quantity()) {
        let fixed = Fixed::quantise(value, quantity);
        let raw = value * f64::from(quantity.fraction_bits()).exp2();
        let expected = if value.is_nan() { 0.0 } else { clamp(raw) };
        prop_assert!((f64::from(fixed.0) - expected).abs() <= 0.5);
        let step = (-f64::from(quantity.fraction_bits())).exp2();
        prop_assert_eq!(fixed.to_f64(quantity), f64::from(fixed.0) * step);
        prop_assert!((f64::from(fixed.to_f32(quantity)) - fixed.to_f64(quantity)).abs()
            <= fixed.to_f64(quantity).abs() * 1e-7);
    }
}

#[test]
fn gains_outside_every_range_neither_panic_nor_wrap() {
    let gain = |value| Fixed::gain(value, Quantity::Integer, Quantity::Integer);
    for huge in [1e12, 1e300, f64::MAX] {
        assert_eq!(Fixed(2).scale(gain(huge)), Fixed(i32::MAX));
        assert_eq!(Fixed(2).scale(gain(-huge)), Fixed(-i32::MAX - 1));
        assert_eq!(Fixed(-2).scale(gain(-huge)), Fixed(i32::MAX));
    }
    for tiny in [1e-25, f64::MIN_POSITIVE, 0.0] {
        assert_eq!(Fixed(i32::MIN).scale(gain(tiny)), Fixed(0));
    }
    for none in [f64::NAN, 0.0, -0.0] {
        assert_eq!(Fixed(i32::MAX).scale(gain(none)), Fixed(0));
    }
    let _: FixedGain = gain(f64::INFINITY);
}

#[test]
fn ranges_are_those_that_the_analysis_states() {
    let limits: Vec<f64> = QUANTITIES.iter().map(|quantity| quantity.limit()).collect();
    let expected = [32.0, 2048.0, 32768.0, 32.0, 2.0, 32.0, 2147483648.0];
    for (limit, expected) in limits.iter().zip(expected) {
        assert!((limit / expected - 1.0).abs() < 1e-9, "{limit} {expected}");
    }
}
