//! Tests of the decimals in messages.

use proptest::prelude::*;
use quadrant_law::decimal::Decimal;

#[test]
fn numbers_are_shown_as_a_person_writes_them() {
    for (value, text) in [
        (0.0, "0"),
        (-0.0, "-0"),
        (1.0, "1"),
        (-0.5, "-0.5"),
        (5e-4, "0.0005"),
        (1e-6, "0.000001"),
        (69_390.0, "69390"),
        (8_388_608.0, "8388608"),
        (0.1 + 0.2, "0.3"),
        (1.0 / 3.0, "0.333333333333"),
        (999_999_999_999.9, "1000000000000"),
        (4_294_967_295.0, "4294967295"),
        (1e9 + 1.0, "1000000001"),
        (1e14, "100000000000000"),
        (1.5e15, "1.5e15"),
        (-1e300, "-1e300"),
        (2.5e-12, "2.5e-12"),
        (f64::MIN_POSITIVE / 1024.0, "2.17292368995e-311"),
        (f64::MAX, "1.79769313486e308"),
        (f64::NAN, "NaN"),
        (f64::INFINITY, "inf"),
        (f64::NEG_INFINITY, "-inf"),
    ] {
        assert_eq!(Decimal(value).to_string(), text);
    }
}

#[test]
fn a_number_of_decimals_is_kept() {
    assert_eq!(format!("{:.3}", Decimal(2.0)), "2.000");
    assert_eq!(format!("{:.3}", Decimal(-1.2345678)), "-1.235");
    assert_eq!(format!("{:.1}", Decimal(0.04)), "0.0");
    assert_eq!(format!("{:.0}", Decimal(7.6)), "8");
    assert_eq!(format!("{:.3}", Decimal(1e20)), "1e20");
}

proptest! {
    /// A number of no more than twelve digits looks as `core` shows it.
    #[test]
    fn short_numbers_are_those_of_core(digits in -999_999_999_999i64..1_000_000_000_000, places in -2i32..7) {
        let value: f64 = format!("{digits}e{}", -places).parse().expect("a number");
        prop_assert_eq!(Decimal(value).to_string(), value.to_string());
    }

    /// The text shows the number to twelve digits.
    #[test]
    fn what_is_shown_is_the_number(value in proptest::num::f64::NORMAL) {
        let shown: f64 = Decimal(value).to_string().parse().expect("a number");
        prop_assert!((shown / value - 1.0).abs() < 6e-12 || shown.is_infinite(), "{value:e} as {shown:e}");
    }
}
