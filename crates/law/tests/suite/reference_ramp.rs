//! Velocity ramps: within their limits, exactly onto their target, and to rest within the promised distance.

use proptest::prelude::*;
use quadrant_law::reference::{MotionScale, Ramp, RampState, Velocity};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::Position;

use quadrant_test_support::repeatable;

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};

/// One unit of position, mm.
const UNIT_MM: f64 = 5e-4 / 65536.0;

fn velocity(value_mm_s: f64) -> Velocity {
    Velocity::from_mm_s(value_mm_s, SCALE)
}

/// Largest addition of the numbers' own rounding to a change of velocity, mm/s.
const ROUNDING_MM_S: f64 = 1e-9;

/// Watches a ramp's every tick.
struct Watch {
    ramp: Ramp<f64>,
    state: RampState,
    acceleration_mm_s2: f64,
    jerk_mm_s3: f64,
    last_change_mm_s: f64,
}

impl Watch {
    fn new(acceleration_mm_s2: f64, jerk_mm_s3: f64) -> Self {
        Self {
            ramp: Ramp::new(acceleration_mm_s2, jerk_mm_s3, SCALE),
            state: RampState::at_rest(Position(12_345_678)),
            acceleration_mm_s2,
            jerk_mm_s3,
            last_change_mm_s: 0.0,
        }
    }

    fn step(&mut self, target: Velocity) -> Result<(), TestCaseError> {
        let (before, position) = (self.state.velocity(), self.state.position());
        let sample = self.ramp.step(&mut self.state, target);
        let now = self.state.velocity().to_mm_s(SCALE);
        let change = now - before.to_mm_s(SCALE);
        let limit = self.acceleration_mm_s2 / SCALE.rate_hz;
        prop_assert!(change.abs() <= limit + ROUNDING_MM_S, "{change} of {limit}");
        let bend = change - self.last_change_mm_s;
        let limit = self.jerk_mm_s3 / SCALE.rate_hz / SCALE.rate_hz;
        prop_assert!(bend.abs() <= limit + ROUNDING_MM_S, "{bend} of {limit}");
        self.last_change_mm_s = change;

        prop_assert!((sample.velocity - now).abs() < 1e-6);
        prop_assert!((sample.acceleration - change * SCALE.rate_hz).abs() < 1e-4);
        let displacement = (sample.position - position).0 as f64 * UNIT_MM * SCALE.rate_hz;
        prop_assert!((displacement - now).abs() <= UNIT_MM * SCALE.rate_hz * 1.001);
        Ok(())
    }

    /// Runs until the target has been held for two ticks.
    fn settle(&mut self, target: Velocity) -> Result<u32, TestCaseError> {
        for tick in 0..3_000_000 {
            let held = self.state.velocity() == target;
            self.step(target)?;
            if held && self.last_change_mm_s == 0.0 && self.state.velocity() == target {
                return Ok(tick);
            }
        }
        Err(TestCaseError::fail("it never settles"))
    }
}

fn any_limits() -> impl Strategy<Value = (f64, f64)> {
    (2.0f64..4.4, 0.5f64..3.5).prop_map(|(acceleration, jerk)| {
        let acceleration = 10f64.powf(acceleration);
        (acceleration, acceleration * 10f64.powf(jerk))
    })
}

fn any_velocity() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -200.0f64..200.0,
        2 => -0.01f64..0.01,
        1 => Just(0.0),
    ]
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn limits_hold_and_every_target_is_met_exactly(
        (acceleration, jerk) in any_limits(),
        targets in prop::collection::vec((any_velocity(), 0u32..4000), 1..6),
    ) {
        let mut watch = Watch::new(acceleration, jerk);
        // Most targets change in flight.
        for &(target, ticks) in &targets {
            for _ in 0..ticks {
                watch.step(velocity(target))?;
            }
        }
        let (last, _) = targets[targets.len() - 1];
        watch.settle(velocity(last))?;
        prop_assert_eq!(watch.state.velocity(), velocity(last));
    }

    #[test]
    fn a_stop_ends_at_rest_within_the_promised_distance(
        (acceleration, jerk) in any_limits(),
        (target, ticks, turning) in (any_velocity(), 0u32..4000, 0u32..2000),
    ) {
        let mut watch = Watch::new(acceleration, jerk);
        for _ in 0..ticks {
            watch.step(velocity(target))?;
        }
        // Rarely in steady motion: mostly in the middle of speeding up, slowing down or turning round.
        for _ in 0..turning {
            watch.step(velocity(-target))?;
        }
        let start = watch.state.position();
        let [backward, forward] = watch.ramp.stop_reach(&watch.state);
        prop_assert!(backward.0 >= 0 && forward.0 >= 0);
        while !watch.state.is_at_rest() {
            watch.step(Velocity::ZERO)?;
            let travel = watch.state.position() - start;
            // A position is rounded down to whole units.
            prop_assert!(travel >= -backward - Position(1), "{travel:?} of {backward:?}");
            prop_assert!(travel <= forward + Position(1), "{travel:?} of {forward:?}");
        }
        let rest = watch.state.position();
        for _ in 0..100 {
            watch.step(Velocity::ZERO)?;
            prop_assert_eq!(watch.state.position(), rest);
        }
    }

    #[test]
    fn the_promised_distance_wastes_little(
        (acceleration, jerk) in any_limits(),
        start in 1.0f64..200.0,
    ) {
        let mut watch = Watch::new(acceleration, jerk);
        watch.settle(velocity(start))?;
        let bound = watch.ramp.stopping_distance(watch.state.velocity()).0 as f64;
        let from = watch.state.position();
        watch.settle(Velocity::ZERO)?;
        let travel = (watch.state.position() - from).0 as f64;
        // Half of the rise of the acceleration, where the braking does not reach its limit; and five ticks.
        let rise = 0.5 * acceleration / jerk * SCALE.rate_hz + 5.0;
        let per_tick = start / SCALE.rate_hz / UNIT_MM;
        prop_assert!(bound - travel <= per_tick * rise, "{bound} {travel}");
        prop_assert!(travel <= bound);
    }

    #[test]
    fn a_motion_in_flight_is_continued_without_a_jump(
        (acceleration, jerk) in any_limits(),
        speed in -100.0f64..100.0,
        share in -1.0f64..1.0,
    ) {
        let per_tick = |value: f64| Position((value / SCALE.rate_hz / UNIT_MM) as i64);
        let change = share * acceleration / SCALE.rate_hz;
        let (displacement, before) = (per_tick(speed), per_tick(speed - change));
        let mut watch = Watch::new(acceleration, jerk);
        watch.state = watch.ramp.take_over(Position(77), displacement, before);
        prop_assert_eq!(watch.state.position(), Position(77));
        // The other motion's acceleration is known to the rounding of two displacements, and met to one multiple of the jerk.
        // One that still speeds up is dropped: the stop keeps to the distance that is promised without it.
        let change = (displacement - before).0;
        if change.signum() * displacement.0.signum() < 0 {
            watch.last_change_mm_s = change as f64 * UNIT_MM * SCALE.rate_hz;
        }
        let bound = watch.ramp.stopping_distance(Velocity::from_displacement(displacement));
        let jerk = watch.jerk_mm_s3;
        watch.jerk_mm_s3 = 2.0 * jerk;
        watch.step(Velocity::ZERO)?;
        watch.jerk_mm_s3 = jerk;
        watch.settle(Velocity::ZERO)?;
        prop_assert!(watch.state.is_at_rest());
        let travel = (watch.state.position() - Position(77)).0 * displacement.0.signum();
        prop_assert!(travel <= bound.0, "{travel} of {bound:?}");
    }
}

#[test]
fn limits_exchanged_in_flight_leave_no_jump() {
    // The stage's settings may change while a ramp is under way.
    let ramps = [
        (20_000.0, 1e6),
        (500.0, 3e3),
        (3e4, f64::INFINITY),
        (2000.0, 1e5),
    ];
    let mut state = RampState::at_rest(Position::ZERO);
    for round in 0..400 {
        let (acceleration, jerk) = ramps[round % ramps.len()];
        let ramp = Ramp::<f64>::new(acceleration, jerk, SCALE);
        let target = velocity(if round / 3 % 2 == 0 { 150.0 } else { -80.0 });
        for _ in 0..round % 37 {
            let before = state.velocity().to_mm_s(SCALE);
            ramp.step(&mut state, target);
            let change = state.velocity().to_mm_s(SCALE) - before;
            assert!(
                change.abs() <= acceleration / SCALE.rate_hz + ROUNDING_MM_S,
                "{change}"
            );
        }
    }
}

#[test]
fn a_stop_takes_the_time_that_acceleration_and_jerk_ask_for() {
    let mut watch = Watch::new(2000.0, 1e5);
    let up = watch.settle(velocity(100.0)).expect("within limits");
    let down = watch.settle(Velocity::ZERO).expect("within limits");
    // v / a + a / j = 50 ms + 20 ms, and the tick that shows it.
    assert!((700..=704).contains(&up), "{up}");
    assert!((700..=704).contains(&down), "{down}");
}

#[test]
fn ten_million_ticks_do_not_drift() {
    let ramp = Ramp::<f32>::new(2000.0, 1e5, SCALE);
    let target = velocity(7.123_456_789);
    let mut state = RampState::at_rest(Position::ZERO);
    while state.velocity() != target {
        ramp.step(&mut state, target);
    }
    ramp.step(&mut state, target);
    let start = state.position();
    for _ in 0..10_000_000 {
        ramp.step(&mut state, target);
    }
    let travel = (state.position() - start).0 as f64;
    let exact = 7.123_456_789 / SCALE.rate_hz / UNIT_MM * 1e7;
    assert!((travel - exact).abs() <= 1.1, "{travel} {exact}");
}

#[test]
fn without_a_limit_of_the_jerk_the_acceleration_alone_limits() {
    let mut watch = Watch::new(1000.0, f64::INFINITY);
    let ticks = watch.settle(velocity(10.0)).expect("within limits");
    assert!((100..=103).contains(&ticks), "{ticks}");
}

#[test]
fn number_types_agree_on_the_position_to_the_unit() {
    let double = Ramp::<f64>::new(1500.0, 4e4, SCALE);
    let fixed = Ramp::<Fixed>::new(1500.0, 4e4, SCALE);
    let mut one = RampState::at_rest(Position::ZERO);
    let mut two = one;
    for tick in 0..3000 {
        let target = velocity(if tick < 1000 { 31.4 } else { -12.3 });
        let exact = double.step(&mut one, target);
        let rounded = fixed.step(&mut two, target);
        assert_eq!(exact.position, rounded.position);
        let velocity = rounded.velocity.to_f64(Quantity::Velocity);
        assert!((velocity - exact.velocity).abs() < 2e-5);
        let acceleration = rounded.acceleration.to_f64(Quantity::Acceleration);
        assert!((acceleration - exact.acceleration).abs() < 1e-3);
    }
}

#[test]
fn the_extremes_of_scale_saturate_and_come_to_rest() {
    for (resolution_mm, rate_hz) in [(1e-6, 1e3), (1.0, 1e5)] {
        let scale = MotionScale {
            resolution_mm,
            rate_hz,
        };
        let ramp = Ramp::<f64>::new(3e4, 1e9, scale);
        let fastest = Position::from_mm(1e3 / rate_hz, resolution_mm);
        for displacement in [Position(i64::MAX), Position(i64::MIN), fastest, -fastest] {
            let mut state = ramp.take_over(Position::ZERO, displacement, Position::ZERO);
            let mut speed = f64::INFINITY;
            for _ in 0..20_000 {
                assert!(ramp.stop_reach(&state).iter().all(|reach| reach.0 >= 0));
                ramp.step(&mut state, Velocity::ZERO);
                let now = state.velocity().to_mm_s(scale).abs();
                // The acceleration that was adopted may last for a few ticks.
                assert!(now <= speed + 3e4 / rate_hz || now <= 1e3);
                speed = now;
            }
            let legal = displacement == fastest || displacement == -fastest;
            assert!(!legal || state.is_at_rest(), "{displacement:?}");
        }
    }
}
