//! The converter's word and its voltage.

use proptest::prelude::*;
use quadrant_law::units::DacCode;

#[test]
fn a_voltage_that_no_code_stands_for_is_the_nearest_or_zero() {
    for (volts, full_scale_v, code) in [
        (0.0, 10.0, 0),
        (10.0, 10.0, i16::MAX),
        (-10.0, 10.0, -i16::MAX),
        (2.5, 5.0, 16_384),
        (-2.5, 5.0, -16_384),
        (10.001, 10.0, i16::MAX),
        (-10.001, 10.0, i16::MIN),
        (f64::INFINITY, 10.0, i16::MAX),
        (f64::NEG_INFINITY, 10.0, i16::MIN),
        (f64::NAN, 10.0, 0),
        (0.0, 0.0, 0),
        (1.0, 0.0, i16::MAX),
    ] {
        let found = DacCode::from_volts(volts, full_scale_v);
        assert_eq!(found, DacCode(code), "{volts} V of {full_scale_v} V");
    }
    assert_eq!(DacCode(i16::MAX).to_volts(5.0), 5.0);
}

proptest! {
    #[test]
    fn a_code_in_volts_is_the_code_again(code: i16, full_scale_v in 0.1..100.0) {
        let volts = DacCode(code).to_volts(full_scale_v);
        prop_assert_eq!(DacCode::from_volts(volts, full_scale_v), DacCode(code));
        prop_assert!((volts - f64::from(code) * full_scale_v / 32767.0).abs() < 1e-13);
    }

    #[test]
    fn a_voltage_within_full_scale_is_met_to_half_a_code(share in -1.0..=1.0, full_scale_v in 0.1..100.0) {
        let volts = share * full_scale_v;
        let met = DacCode::from_volts(volts, full_scale_v).to_volts(full_scale_v);
        prop_assert!((met - volts).abs() <= 0.500_001 * full_scale_v / 32767.0);
    }
}
