//! Streams of set points: what a host sends is what the axes do, within their limits, without a jolt.

use core::f64::consts::TAU;

use proptest::prelude::*;
use quadrant_law::reference::{
    MotionScale, ReferenceSample, Segment, Stream, StreamState, StreamStep,
};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::Position;
use quadrant_settings::stream_planner::{
    AxisPoint, MOST_SEGMENT_TICKS, SetPoint, StreamLimits, StreamPlanner,
};

use quadrant_test_support::repeatable;

pub(crate) const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};

/// One unit of position, mm.
const UNIT_MM: f64 = 5e-4 / 65536.0;

pub(crate) const LIMITS: StreamLimits = StreamLimits {
    scale: SCALE,
    max_velocity_mm_s: 200.0,
    max_acceleration_mm_s2: 2000.0,
    travel: None,
    has_law: true,
};

pub(crate) fn mm(value: f64) -> Position {
    Position::from_mm(value, SCALE.resolution_mm)
}

pub(crate) fn point(position_mm: f64, velocity_mm_s: f64, acceleration_mm_s2: f64) -> AxisPoint {
    AxisPoint::new(
        ReferenceSample {
            position: mm(position_mm),
            velocity: velocity_mm_s,
            acceleration: acceleration_mm_s2,
        },
        SCALE,
    )
}

/// A set point of x; the others rest at the origin.
pub(crate) fn on_x(number: u32, x: AxisPoint) -> SetPoint {
    SetPoint {
        number,
        axes: [x, AxisPoint::default(), AxisPoint::default()],
        last: false,
    }
}

fn planner(period_ticks: u32) -> StreamPlanner {
    StreamPlanner::new([LIMITS; 3], period_ticks, [Position::ZERO; 3])
}

/// Feeds segments to one axis as the control task does, and gathers the samples up to the end or the underrun.
fn play<S: Scalar>(segments: &[Segment]) -> (Vec<ReferenceSample<S>>, bool) {
    let stream = Stream::<S>::new(SCALE);
    let (mut state, mut queue, mut samples) = (StreamState::default(), segments.iter(), vec![]);
    loop {
        if state.wants_segment()
            && let Some(segment) = queue.next()
        {
            state.offer(segment);
        }
        match stream.step(&mut state) {
            StreamStep::Moving(sample) => samples.push(sample),
            StreamStep::Finished(sample) => {
                samples.push(sample);
                return (samples, true);
            }
            StreamStep::Underrun => return (samples, false),
        }
    }
}

/// Radius of the circle, mm. Its motion is one turn from rest to rest.
const RADIUS_MM: f64 = 20.0;
/// Time of this turn, s.
const SECONDS: f64 = 4.0;
fn circle(time_s: f64) -> [[f64; 3]; 2] {
    let share = time_s / SECONDS;
    let angle = TAU * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share.powi(2));
    let speed = TAU / SECONDS * 30.0 * share.powi(2) * (1.0 - share).powi(2);
    let change = TAU / SECONDS.powi(2) * 60.0 * share * (1.0 - share) * (1.0 - 2.0 * share);
    let (sine, cosine) = angle.sin_cos();
    let r = RADIUS_MM;
    [
        [
            r * (cosine - 1.0),
            -r * speed * sine,
            -r * (speed * speed * cosine + change * sine),
        ],
        [
            r * sine,
            r * speed * cosine,
            r * (change * cosine - speed * speed * sine),
        ],
    ]
}

/// Streams the circle with one set point in `stride` periods; the largest distance from it, mm.
fn follow_circle(period_ticks: u32, stride: u32) -> f64 {
    let mut planner = planner(period_ticks);
    let last = (SECONDS * SCALE.rate_hz) as u32 / period_ticks;
    let mut segments = [const { Vec::new() }; 2];
    for number in (stride..=last).step_by(stride as usize) {
        let time_s = f64::from(number * period_ticks) / SCALE.rate_hz;
        let [x, y] = circle(time_s)
            .map(|[position, velocity, acceleration]| point(position, velocity, acceleration));
        let axes = [x, y, AxisPoint::default()];
        let ends = number == last;
        let axes = if ends {
            [AxisPoint::at_rest(Position::ZERO); 3]
        } else {
            axes
        };
        let made = planner
            .plan(&SetPoint {
                number,
                axes,
                last: ends,
            })
            .expect("within limits");
        segments[0].push(made[0]);
        segments[1].push(made[1]);
    }
    let mut farthest = 0.0f64;
    for (index, segments) in segments.iter().enumerate() {
        let (samples, finished) = play::<f64>(segments);
        assert!(finished);
        assert_eq!(samples.len() as f64, SECONDS * SCALE.rate_hz);
        for (tick, sample) in samples.iter().enumerate() {
            let time_s = (tick + 1) as f64 / SCALE.rate_hz;
            let [position, velocity, acceleration] = circle(time_s)[index];
            let off = sample.position.to_mm(SCALE.resolution_mm) - position;
            farthest = farthest.max(off.abs());
            // Of the polynomial's derivatives less is promised than of the position, and rounded set points at short
            // periods make them rough.
            let (period, unit_mm_s) = (f64::from(period_ticks), UNIT_MM * SCALE.rate_hz);
            let period_s = f64::from(period_ticks * stride) / SCALE.rate_hz;
            let rough = 1e-5 + 4.0 / period * unit_mm_s + period_s.powi(5) * 600.0;
            assert!((sample.velocity - velocity).abs() < rough, "{tick}");
            let rough =
                1e-3 + 12.0 / period.powi(2) * unit_mm_s * SCALE.rate_hz + period_s.powi(4) * 4e3;
            assert!((sample.acceleration - acceleration).abs() < rough, "{tick}");
        }
        let end = samples[samples.len() - 1];
        assert_eq!(end.position, Position::ZERO);
        assert_eq!((end.velocity, end.acceleration), (0.0, 0.0));
    }
    farthest
}

/// Error bound of interpolation of fifth degree: `h^6 / 46080` times the sixth derivative of the motion; and the
/// rounding of the set points and of the ticks to whole units.
fn circle_bound(period_s: f64) -> f64 {
    // That of the circle with this course of the angle is at most 46 450 mm/s^6, by its Taylor series at 4000 places.
    const SIXTH_DERIVATIVE: f64 = 4.7e4;
    period_s.powi(6) / 46080.0 * SIXTH_DERIVATIVE + 2.0 * UNIT_MM
}

#[test]
fn a_streamed_circle_follows_the_analytic_one() {
    for period_ticks in [4, 10, 100, 1000] {
        let farthest = follow_circle(period_ticks, 1);
        let bound = circle_bound(f64::from(period_ticks) / SCALE.rate_hz);
        assert!(farthest <= bound, "{period_ticks}: {farthest} of {bound}");
    }
}

#[test]
fn a_circle_of_which_every_second_set_point_is_missing_is_followed_over_the_doubled_period() {
    for period_ticks in [10, 100, 500] {
        let farthest = follow_circle(period_ticks, 2);
        let bound = circle_bound(f64::from(2 * period_ticks) / SCALE.rate_hz);
        assert!(farthest <= bound, "{period_ticks}: {farthest} of {bound}");
    }
}

#[test]
fn a_missing_segment_is_an_underrun_in_the_tick_that_needs_it() {
    let mut planner = planner(10);
    let moving = planner
        .plan(&on_x(1, point(0.0001, 0.2, 0.0)))
        .expect("slow");
    let (samples, finished) = play::<f32>(&moving[..1]);
    assert!(!finished);
    assert_eq!(samples.len(), 10);
    assert_eq!(samples[9].position, mm(0.0001));
}

#[test]
fn what_is_left_of_a_stream_that_was_broken_off_is_dropped() {
    let mut planner = planner(10);
    let old: Vec<Segment> = (1..=3)
        .map(|number| {
            planner
                .plan(&on_x(number, AxisPoint::default()))
                .expect("rest")[0]
        })
        .collect();
    let mut state = StreamState::default();
    state.offer(&old[0]);
    assert!(state.is_ready(Position::ZERO));
    assert!(!state.is_ready(Position(1)), "the axis stands elsewhere");
    state.clear();
    state.offer(&old[1]);
    assert!(state.wants_segment(), "dropped");
    state.offer(&old[0]);
    assert!(!state.wants_segment(), "a new stream");
}

/// Set points of x that a smooth motion could pass, with random signs and sizes.
fn any_points() -> impl Strategy<Value = (u32, Vec<(f64, f64, f64)>)> {
    (5u32..=250).prop_flat_map(|period_ticks| {
        let period_s = f64::from(period_ticks) / SCALE.rate_hz;
        let one = (-0.03f64..0.03, -0.5f64..0.5, -500.0f64..500.0);
        let points = prop::collection::vec(one, 2..8).prop_map(move |points| {
            points
                .into_iter()
                .map(|(position, velocity, acceleration)| {
                    (
                        position * 2000.0 * period_s * period_s,
                        velocity * 500.0 * period_s,
                        acceleration,
                    )
                })
                .collect()
        });
        (Just(period_ticks), points)
    })
}

/// The quintic Hermite polynomial at `share` of a segment of `period_s` between positions, velocities, accelerations.
fn hermite(from: [f64; 3], to: [f64; 3], share: f64, period_s: f64) -> f64 {
    let basis = |share: f64| {
        let (cube, square) = (share.powi(3), share * share);
        [
            1.0 - cube * (10.0 - 15.0 * share + 6.0 * square),
            period_s * (share - cube * (6.0 - 8.0 * share + 3.0 * square)),
            period_s * period_s * 0.5 * (square - cube * (3.0 - 3.0 * share + square)),
        ]
    };
    // Seen from the other end, velocities change their sign.
    let sum = |weights: [f64; 3], ends: [f64; 3]| -> f64 {
        weights
            .iter()
            .zip(ends)
            .map(|(weight, end)| weight * end)
            .sum()
    };
    sum(basis(share), from) + sum(basis(1.0 - share), [to[0], -to[1], to[2]])
}

/// The differences of neighbouring values.
fn differences(values: &[i64]) -> Vec<i64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn position_velocity_and_acceleration_are_continuous_and_within_limits(
        (period_ticks, points) in any_points(),
    ) {
        let mut planner = planner(period_ticks);
        let mut segments = vec![];
        let mut targets = vec![];
        for (index, &(position, velocity, acceleration)) in points.iter().enumerate() {
            let set_point = on_x(index as u32 + 1, point(position, velocity, acceleration));
            match planner.plan(&set_point) {
                Ok(made) => segments.push(made[0]),
                Err(error) => {
                    prop_assert_eq!(error.number, index as u32 + 1);
                    break;
                }
            }
            targets.push(mm(position));
        }
        prop_assume!(segments.len() > 1);
        let (samples, _) = play::<f64>(&segments);
        let period = period_ticks as usize;
        let period_s = f64::from(period_ticks) / SCALE.rate_hz;
        for (index, target) in targets.iter().enumerate() {
            prop_assert_eq!(samples[(index + 1) * period - 1].position, *target, "to the unit");
        }
        let mut positions = vec![0];
        positions.extend(samples.iter().map(|sample| sample.position.0));
        let first = differences(&positions);
        let second = differences(&first);
        let to_mm_s = UNIT_MM * SCALE.rate_hz;
        let to_mm_s2 = to_mm_s * SCALE.rate_hz;
        // Positions are rounded to units: up to 1 in a first, 2 in a second, 4 in a third difference; set points too.
        let rounding = 12.0 / f64::from(period_ticks * period_ticks) + 2.0;
        for difference in &first {
            prop_assert!((*difference as f64 * to_mm_s).abs() <= 200.0 + 2.0 * to_mm_s);
        }
        for difference in &second {
            prop_assert!((*difference as f64 * to_mm_s2).abs() <= 2000.0 + rounding * to_mm_s2);
        }
        // And it is the polynomial of each two set points, so velocity and acceleration pass through theirs.
        let mut from = [0.0; 3];
        for (index, samples) in samples.chunks(period).enumerate() {
            let (position, velocity, acceleration) = points[index];
            let to = [position, velocity, acceleration];
            for (tick, sample) in samples.iter().enumerate() {
                let exact = hermite(from, to, (tick + 1) as f64 / f64::from(period_ticks), period_s);
                let off = sample.position.to_mm(SCALE.resolution_mm) - exact;
                prop_assert!(off.abs() <= 2.0 * UNIT_MM, "{index} {tick}: {off}");
            }
            from = to;
        }
    }

    #[test]
    fn no_set_point_makes_the_planner_fail(
        points in prop::collection::vec(
            (any::<u32>(), any::<i64>(), any::<f64>(), any::<f64>(), any::<bool>()), 1..6),
        period_ticks in any::<u32>(),
        start in any::<i64>(),
    ) {
        let mut planner = StreamPlanner::new([LIMITS; 3], period_ticks, [Position(start); 3]);
        for (number, position, velocity, acceleration, last) in points {
            let before = planner.clone();
            let x = AxisPoint::new(
                ReferenceSample { position: Position(position), velocity, acceleration },
                SCALE,
            );
            let set_point = SetPoint { number: number % 4 + before.number(), axes: [x; 3], last };
            if planner.plan(&set_point).is_err() {
                prop_assert_eq!(&planner, &before, "a refused set point changes nothing");
            }
        }
    }
}

#[test]
fn the_longest_segment_meets_its_end_to_the_unit() {
    let mut planner = planner(MOST_SEGMENT_TICKS);
    let target = 3.215_926_53;
    let segment = planner
        .plan(&on_x(1, point(target, 50.0, 300.0)))
        .expect("slow")[0];
    let (samples, _) = play::<f64>(&[segment]);
    assert_eq!(samples[samples.len() - 1].position, mm(target));
}

#[test]
fn number_types_agree_on_the_position_to_the_unit() {
    let mut planner = planner(100);
    let segments: Vec<Segment> = (1..=40)
        .map(|number| {
            let [[position, velocity, acceleration], _] = circle(f64::from(number) * 0.01);
            let set_point = on_x(number, point(position, velocity, acceleration));
            planner.plan(&set_point).expect("within limits")[0]
        })
        .collect();
    let (exact, _) = play::<f64>(&segments);
    let (rounded, _) = play::<Fixed>(&segments);
    for (exact, rounded) in exact.iter().zip(&rounded) {
        assert_eq!(exact.position, rounded.position);
        let velocity = rounded.velocity.to_f64(Quantity::Velocity);
        assert!((velocity - exact.velocity).abs() < 2e-5);
        let acceleration = rounded.acceleration.to_f64(Quantity::Acceleration);
        assert!((acceleration - exact.acceleration).abs() < 1e-3);
    }
}
