//! The Stribeck curve, the static model, and their tables.

use proptest::prelude::*;
use quadrant_law::friction::stribeck::{SlidingTable, StaticFriction, StribeckCurve};
use quadrant_law::friction::{Direction, PerDirection};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};

use quadrant_test_support::repeatable;

const PERIOD_S: f64 = 1e-4;

/// Curves over the whole of the validated ranges, falling and rising with the speed; those whose table errs too much are refused
/// by validation too.
fn accepted_curves() -> impl Strategy<Value = StribeckCurve> {
    (-6.0f64..1.0, 0.0f64..10.0, -3.0f64..2.0, 0.3f64..=4.0)
        .prop_map(|(log_breakaway, share, log_velocity, exponent)| {
            let breakaway_v = 10f64.powf(log_breakaway);
            StribeckCurve {
                coulomb_v: (breakaway_v * share).clamp(1e-6, 10.0),
                breakaway_v: breakaway_v.max(1e-6),
                stribeck_velocity_mm_s: 10f64.powf(log_velocity),
                exponent,
            }
        })
        .prop_filter("refused by validation", |curve| {
            curve.table_error_v() <= 1e-3 * curve.breakaway_v
        })
}

/// The largest error of s(v) over a dense sweep of speeds, as a share of Fs.
fn worst<S: Scalar>(curve: &StribeckCurve) -> f64 {
    let attraction_v_s = 0.5 * curve.coulomb_v.min(curve.breakaway_v) / PERIOD_S;
    let table = SlidingTable::<S>::build(&PerDirection::both(*curve), attraction_v_s, PERIOD_S);
    let mut worst: f64 = 0.0;
    for step in 0..3000 {
        // From far below the first node to far beyond the last.
        let speed = curve.flat_velocity_mm_s() * 10f64.powf(-6.0 + 6.5 * f64::from(step) / 3000.0);
        let speed = S::quantise(speed, Quantity::Velocity);
        let level = table.at(speed, Direction::Positive).level;
        let exact = curve.level_v(speed.to_f64(Quantity::Velocity));
        worst = worst.max((level.to_f64(Quantity::Voltage) - exact).abs());
    }
    worst / curve.breakaway_v
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn tables_are_within_a_thousandth_of_breakaway(curve in accepted_curves()) {
        prop_assert!(worst::<f64>(&curve) <= 1e-3, "f64 {}", worst::<f64>(&curve));
        prop_assert!(worst::<f32>(&curve) <= 1e-3 + 1e-6, "f32 {}", worst::<f32>(&curve));
        // A level of a few microvolts is a few steps of the format.
        let steps = 2.0 / (1u32 << 26) as f64 / curve.breakaway_v;
        let fixed = worst::<Fixed>(&curve);
        prop_assert!(fixed <= 1e-3 + steps, "fixed {fixed} {steps}");
    }

    #[test]
    fn decay_belongs_to_the_level(curve in accepted_curves(), place in 0.0f64..2.0) {
        let attraction_v_s = 0.3 * curve.coulomb_v.min(curve.breakaway_v) / PERIOD_S;
        let table = SlidingTable::<f64>::build(&PerDirection::both(curve), attraction_v_s, PERIOD_S);
        let speed = place * curve.flat_velocity_mm_s();
        let decay = table.at(speed, Direction::Negative).decay;
        let exact = (-attraction_v_s * PERIOD_S / curve.level_v(speed)).exp();
        // Chords of a curve that bends where s(v) is small against Fs.
        prop_assert!((decay - exact).abs() < 0.02, "{decay} {exact}");
    }
}

const CURVE: StribeckCurve = StribeckCurve {
    coulomb_v: 0.12,
    breakaway_v: 0.15,
    stribeck_velocity_mm_s: 1.0,
    exponent: 1.0,
};

#[test]
fn level_falls_from_breakaway_to_coulomb_by_the_formula() {
    assert_eq!(CURVE.level_v(0.0), 0.15);
    assert!((CURVE.level_v(1.0) - (0.12 + 0.03 / core::f64::consts::E)).abs() < 1e-15);
    assert_eq!(CURVE.level_v(-2.5), CURVE.level_v(2.5));
    assert!((CURVE.level_v(1e3) - 0.12).abs() < 1e-15);
    let gaussian = StribeckCurve {
        exponent: 2.0,
        ..CURVE
    };
    assert!((gaussian.level_v(0.5) - (0.12 + 0.03 * (-0.25f64).exp())).abs() < 1e-15);
}

#[test]
fn a_level_may_rise_with_the_speed() {
    let rising = StribeckCurve {
        breakaway_v: 0.05,
        ..CURVE
    };
    assert_eq!(rising.level_v(0.0), 0.05);
    assert!((rising.level_v(1.0) - (0.12 - 0.07 / core::f64::consts::E)).abs() < 1e-15);
    assert!(worst::<f32>(&rising) < 1e-3);
}

#[test]
fn static_friction_opposes_motion_and_is_zero_at_rest() {
    let friction = StaticFriction {
        curve: CURVE,
        viscous_v_s_per_mm: 0.001,
    };
    assert_eq!(friction.friction_v(0.0), 0.0);
    let forward = friction.friction_v(10.0);
    assert!((forward - (CURVE.level_v(10.0) + 0.01)).abs() < 1e-15);
    assert_eq!(friction.friction_v(-10.0), -forward);
}

#[test]
fn each_direction_has_its_own_curve() {
    let other = StribeckCurve {
        coulomb_v: 0.2,
        breakaway_v: 0.3,
        ..CURVE
    };
    let table = SlidingTable::<f64>::build(
        &PerDirection {
            positive: CURVE,
            negative: other,
        },
        5.0,
        PERIOD_S,
    );
    assert_eq!(table.at(0.0, Direction::Positive).level, 0.15);
    assert_eq!(table.at(0.0, Direction::Negative).level, 0.3);
}

#[test]
fn a_curve_without_a_drop_is_flat() {
    let flat = StribeckCurve {
        breakaway_v: 0.12,
        ..CURVE
    };
    assert_eq!(worst::<f64>(&flat), 0.0);
}

#[test]
fn default_tables_err_by_far_less_than_allowed() {
    for axis in quadrant_settings::StageSettings::simulated().axes {
        let curve = axis.friction.sliding.positive.curve;
        let error = worst::<f32>(&curve);
        println!("worst error of s(v) over Fs: {error:.1e}");
        assert!(error < 3e-4, "{error:.1e}");
    }
}
