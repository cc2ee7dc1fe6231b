//! Jerk-limited moves: within their limits, exactly onto their target.

use proptest::prelude::*;
use quadrant_law::reference::{
    Motion, MotionScale, MotionSettings, MotionState, PointToPointSettings,
};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::Position;

use quadrant_test_support::repeatable;

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};

/// One unit of position, mm.
const UNIT_MM: f64 = 5e-4 / 65536.0;

fn build<S: Scalar>(settings: PointToPointSettings) -> Motion<S> {
    Motion::build(&MotionSettings::PointToPoint(settings), SCALE)
}

fn any_move() -> impl Strategy<Value = PointToPointSettings> {
    (
        -4.0f64..1.5,
        any::<bool>(),
        0.5f64..2.5,
        2.0f64..4.4,
        3.5f64..6.5,
    )
        .prop_map(
            |(distance, back, velocity, acceleration, jerk)| PointToPointSettings {
                distance_mm: 10f64.powf(distance) * if back { -1.0 } else { 1.0 },
                max_velocity_mm_s: 10f64.powf(velocity),
                max_acceleration_mm_s2: 10f64.powf(acceleration),
                max_jerk_mm_s3: 10f64.powf(jerk),
            },
        )
}

/// Runs a move to its end under the eyes of its limits; its duration in ticks and its peaks as shares of the limits.
fn run(settings: &PointToPointSettings) -> Result<(u32, [f64; 3]), TestCaseError> {
    let motion = build::<f64>(*settings);
    let target = Position::from_mm(settings.distance_mm, SCALE.resolution_mm);
    let mut state = MotionState::default();
    let mut last = Position::ZERO;
    let mut last_acceleration = 0.0;
    let mut peaks = [0.0f64; 3];
    let rate = SCALE.rate_hz;
    // The rounding of a position to whole units, and of an acceleration to 2^-32 counts per tick squared.
    let rounding = [UNIT_MM * rate, 1e-4, 2e-4 * rate];
    while !motion.finished(&state) {
        let sample = motion.step(&mut state);
        let difference = (sample.position - last).0 as f64 * UNIT_MM * rate;
        let jerk = (sample.acceleration - last_acceleration) * rate;
        prop_assert!((difference - sample.velocity).abs() <= 2.0 * rounding[0]);
        let limits = [
            settings.max_velocity_mm_s,
            settings.max_acceleration_mm_s2,
            settings.max_jerk_mm_s3,
        ];
        let values = [sample.velocity.abs(), sample.acceleration.abs(), jerk.abs()];
        for index in 0..3 {
            let most = limits[index] + rounding[index];
            prop_assert!(
                values[index] <= most,
                "{index}: {} of {}",
                values[index],
                limits[index]
            );
            peaks[index] = peaks[index].max(values[index] / limits[index]);
        }
        prop_assert!(difference * settings.distance_mm >= 0.0, "never backwards");
        last = sample.position;
        last_acceleration = sample.acceleration;
        prop_assert!(state.elapsed() < 3_000_000, "it ends");
    }
    prop_assert_eq!(last, target);
    let rest = motion.step(&mut state);
    prop_assert_eq!(
        (rest.position, rest.velocity, rest.acceleration),
        (target, 0.0, 0.0)
    );
    Ok((state.elapsed(), peaks))
}

proptest! {
    #![proptest_config(repeatable(100))]

    #[test]
    fn limits_hold_and_the_target_is_met_exactly(settings in any_move()) {
        run(&settings)?;
    }
}

#[test]
fn a_long_move_uses_all_of_its_limits() {
    let settings = PointToPointSettings {
        distance_mm: 100.0,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 2000.0,
        max_jerk_mm_s3: 1e5,
    };
    let (ticks, peaks) = run(&settings).expect("within limits");
    // D/v + v/a + a/j.
    assert_eq!(ticks, 10_000 + 500 + 200 + 2);
    assert!(peaks.iter().all(|peak| *peak > 0.999), "{peaks:?}");
}

#[test]
fn a_short_move_takes_no_longer_than_its_jerk_needs() {
    let settings = PointToPointSettings {
        distance_mm: 0.001,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 2000.0,
        max_jerk_mm_s3: 1e5,
    };
    let (ticks, peaks) = run(&settings).expect("within limits");
    // D = 2 j T^3, four phases of T.
    let phase = (0.001f64 / 2e5).cbrt() * 1e4;
    assert!(
        f64::from(ticks) <= 4.0 * (phase + 1.0) + 2.0,
        "{ticks} {phase}"
    );
    assert!(peaks[2] > 0.85, "{peaks:?}");
}

#[test]
fn a_move_of_a_single_unit_arrives() {
    for distance_mm in [UNIT_MM, -UNIT_MM, 0.0] {
        let settings = PointToPointSettings {
            distance_mm,
            max_velocity_mm_s: 100.0,
            max_acceleration_mm_s2: 2000.0,
            max_jerk_mm_s3: 1e5,
        };
        run(&settings).expect("within limits");
    }
}

#[test]
fn a_move_that_takes_longer_than_the_tick_counter_holds_stays_slow() {
    for max_velocity_mm_s in [1e-4, 3e-5, f64::MIN_POSITIVE] {
        let motion = build::<f32>(PointToPointSettings {
            distance_mm: 100.0,
            max_velocity_mm_s,
            max_acceleration_mm_s2: 2000.0,
            max_jerk_mm_s3: 1e5,
        });
        let mut state = MotionState::default();
        let mut last = Position::ZERO;
        for _ in 0..10_000 {
            let position = motion.step(&mut state).position;
            let speed_mm_s = (position - last).0 as f64 * UNIT_MM * SCALE.rate_hz;
            assert!(speed_mm_s.abs() < 1e-3, "{max_velocity_mm_s}: {speed_mm_s}");
            last = position;
        }
    }
}

#[test]
fn number_types_agree_on_the_position_to_the_unit() {
    let settings = PointToPointSettings {
        distance_mm: -3.3,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 2000.0,
        max_jerk_mm_s3: 1e5,
    };
    let (double, fixed) = (build::<f64>(settings), build::<Fixed>(settings));
    let (mut one, mut two) = (MotionState::default(), MotionState::default());
    while !double.finished(&one) {
        let (exact, rounded) = (double.step(&mut one), fixed.step(&mut two));
        assert_eq!(exact.position, rounded.position);
        let velocity = rounded.velocity.to_f64(Quantity::Velocity);
        assert!(
            (velocity - exact.velocity).abs() < 2e-5,
            "{velocity} {exact:?}"
        );
        let acceleration = rounded.acceleration.to_f64(Quantity::Acceleration);
        assert!(
            (acceleration - exact.acceleration).abs() < 1e-3,
            "{acceleration} {exact:?}"
        );
    }
}
