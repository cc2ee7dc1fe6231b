//! Recorded tables: through every sample, without a step of velocity.

use proptest::prelude::*;
use quadrant_law::reference::{Motion, MotionScale, MotionState, RecordedTable};
use quadrant_law::units::Position;

use quadrant_test_support::repeatable;

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};
const UNIT_MM: f64 = 5e-4 / 65536.0;

fn table(samples: &[i64], ticks_per_sample: u32) -> Motion<f64> {
    let samples: Vec<Position> = samples.iter().copied().map(Position).collect();
    Motion::Recorded(RecordedTable::new(samples.leak(), ticks_per_sample, SCALE))
}

/// Samples with a smooth walk between them, in units.
fn walks() -> impl Strategy<Value = Vec<i64>> {
    prop::collection::vec(-2_000_000i64..2_000_000, 1..30).prop_map(|steps| {
        let mut place = 77_000_000;
        steps
            .iter()
            .map(|step| {
                place += step;
                place
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn every_sample_is_met_exactly_the_last_included(samples in walks(), ticks in 1u32..50) {
        let motion = table(&samples, ticks);
        let origin = Position(-5_000);
        let mut state = MotionState::start(origin);
        let mut seen = vec![];
        while !motion.finished(&state) {
            seen.push(motion.step(&mut state).position);
        }
        prop_assert_eq!(seen.len(), (samples.len() - 1) * ticks as usize + 1);
        for (index, sample) in samples.iter().enumerate() {
            let expected = origin + Position(sample - samples[0]);
            prop_assert_eq!(seen[index * ticks as usize], expected, "sample {}", index);
        }
    }

    #[test]
    fn velocity_is_continuous_and_the_derivative_of_position(
        samples in walks(),
        ticks in 20u32..60,
    ) {
        let motion = table(&samples, ticks);
        let mut state = MotionState::default();
        let mut seen = vec![];
        while !motion.finished(&state) {
            seen.push(motion.step(&mut state));
        }
        let rate = SCALE.rate_hz;
        let rounding = 4.0 * UNIT_MM * rate;
        // The largest acceleration between the samples.
        let steepest = seen.iter().map(|s| s.acceleration.abs()).fold(0.0, f64::max);
        let bend = 1.2 * steepest / rate + rounding;
        for pair in seen.windows(2) {
            let difference = (pair[1].position - pair[0].position).0 as f64 * UNIT_MM * rate;
            prop_assert!((pair[1].velocity - pair[0].velocity).abs() <= bend, "{pair:?}");
            let mean = 0.5 * (pair[0].velocity + pair[1].velocity);
            prop_assert!((difference - mean).abs() <= bend, "{difference} {pair:?}");
        }
    }

    #[test]
    fn any_samples_and_any_spacing_do_not_panic(
        samples in prop::collection::vec(-(1i64 << 40)..1 << 40, 0..8),
        ticks in prop_oneof![0u32..4, any::<u32>()],
    ) {
        let motion = table(&samples, ticks);
        let mut state = MotionState::default();
        for _ in 0..20 {
            let sample = motion.step(&mut state);
            prop_assert!(sample.velocity.is_finite() && sample.acceleration.is_finite());
        }
    }
}

#[test]
fn a_sample_every_tick_plays_the_record_itself() {
    let samples = [0, 10, 40, 90, 90, -20];
    let motion = table(&samples, 1);
    let mut state = MotionState::default();
    for (index, sample) in samples.iter().enumerate() {
        assert!(!motion.finished(&state), "sample {index}");
        assert_eq!(motion.step(&mut state).position, Position(*sample));
    }
    assert!(motion.finished(&state));
    assert_eq!(motion.step(&mut state).position, Position(-20));
}

#[test]
fn constant_velocity_and_acceleration_are_reproduced() {
    let rate = SCALE.rate_hz / 10.0;
    let square: Vec<i64> = (0..40i64).map(|index| 1000 * index * index).collect();
    let motion = table(&square, 10);
    let mut state = MotionState::default();
    // The ends lack a neighbour.
    for tick in 0..380 {
        let sample = motion.step(&mut state);
        if tick >= 10 {
            let place = f64::from(tick) / 10.0;
            let exact = [
                2000.0 * place * rate * UNIT_MM,
                2000.0 * rate * rate * UNIT_MM,
            ];
            assert!(
                (sample.velocity - exact[0]).abs() < 1e-4,
                "{sample:?} {exact:?}"
            );
            assert!(
                (sample.acceleration - exact[1]).abs() < 0.1,
                "{sample:?} {exact:?}"
            );
        }
    }
}

#[test]
fn an_empty_or_single_sample_is_a_motion_that_ends_at_once() {
    for samples in [&[][..], &[5_000_000][..]] {
        let motion = table(samples, 10);
        let mut state = MotionState::start(Position(42));
        assert_eq!(motion.step(&mut state).position, Position(42));
        assert!(motion.finished(&state));
    }
}
