//! The small slow motions on which no law may be worse than the PID, and a run of one.

use std::fmt;

use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_sim::sine_test::SineTest;

use super::sines::{Cycles, MOST_ACCELERATION, fitted, one_lasts_s, run_cycles};
use crate::test_axis::{AxisInfo, Drive, Experiment, ExperimentError, TestAxis};

/// A small slow motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SmallMotion {
    /// A sine.
    Sine(SineTest, Cycles),
    /// Moves to and fro, and a short rest after each.
    Moves(Moves),
}

/// Moves to and fro.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moves {
    /// Length of a move, mm.
    pub distance_mm: f64,
    /// Its largest velocity, mm/s.
    pub velocity_mm_s: f64,
}

const fn sine(amplitude_mm: f64, velocity_mm_s: f64, cycles: Cycles) -> SmallMotion {
    let sine = SineTest {
        amplitude_mm,
        velocity_mm_s,
    };
    SmallMotion::Sine(sine, cycles)
}

const fn moves(distance_mm: f64, velocity_mm_s: f64) -> SmallMotion {
    SmallMotion::Moves(Moves {
        distance_mm,
        velocity_mm_s,
    })
}

/// The small slow motions. The frequency decides if a table behind a spring is thrown: most of the short sines are at 3 to 12 Hz, and many of their
/// cycles count, for an axis that sticks does not do the same in each. The last ones are slow, or longer at a moderate speed: they show an axis that meets less
/// friction at such a speed than is fed forward, or one that turns so slowly that the PID follows.
const SMALL_MOTIONS: [SmallMotion; 28] = [
    sine(0.02, 0.6, Cycles::scoring(9)),
    sine(0.02, 0.9, Cycles::scoring(9)),
    sine(0.02, 1.2, Cycles::scoring(9)),
    sine(0.03, 0.9, Cycles::scoring(9)),
    sine(0.03, 1.4, Cycles::scoring(9)),
    sine(0.05, 1.0, Cycles::scoring(9)),
    sine(0.05, 1.4, Cycles::scoring(9)),
    sine(0.055, 0.75, Cycles::scoring(9)),
    sine(0.06, 1.55, Cycles::scoring(9)),
    sine(0.02, 1.55, Cycles::scoring(9)),
    sine(0.08, 1.45, Cycles::scoring(9)),
    sine(0.15, 1.55, Cycles::scoring(5)),
    sine(0.02, 0.35, Cycles::scoring(9)),
    sine(0.05, 0.25, Cycles::of_slow(3)),
    moves(0.025, 0.38),
    moves(0.02, 1.3),
    moves(0.09, 2.2),
    moves(0.05, 8.0),
    moves(0.1, 18.0),
    sine(0.11, 3.2, Cycles::scoring(5)),
    sine(0.24, 6.0, Cycles::scoring(5)),
    moves(1.8, 2.8),
    sine(0.1, 0.35, Cycles::of_slow(3)),
    sine(0.18, 0.2, Cycles::of_slow(1)),
    sine(0.7, 0.85, Cycles::of_slow(2)),
    sine(0.6, 0.45, Cycles::of_slow(1)),
    sine(1.9, 1.25, Cycles::of_slow(2)),
    sine(0.9, 0.2, Cycles::of_slow(1)),
];
/// Number of them, the short ones, after which the PID's scores on the others are needed: those take most of the time.
pub(super) const SHORT_MOTIONS: usize = 21;
/// Number of them, the first ones, on which a law has to keep its margin: there the table is thrown by what is fed forward beyond its friction.
pub(super) const MARGIN_MOTIONS: usize = 7;
/// Velocity of most of the sines at most, mm/s.
pub(super) const FROM_MM_S: f64 = 1.6;

/// Acceleration of a move at most, mm/s2, and its jerk over it, 1/s.
const MOVE_MM_S2: f64 = 400.0;
const MOVE_JERK_PER_S: f64 = 100.0;
/// Rest after a move, s.
const REST_S: f64 = 0.3;
/// Number of moves out and back.
const PAIRS: usize = 4;

/// Largest velocity of a move over the velocity limit.
const MOST_MOVE_VELOCITY: f64 = 0.9;

/// The small slow motions that fit an axis.
pub(super) fn small_motions(info: &AxisInfo) -> Vec<SmallMotion> {
    let most_mm_s = MOST_MOVE_VELOCITY * info.max_velocity_mm_s;
    let fit = |motion: &SmallMotion| match *motion {
        SmallMotion::Sine(sine, cycles) => SmallMotion::Sine(fitted(sine, info), cycles),
        SmallMotion::Moves(moves) => SmallMotion::Moves(Moves {
            velocity_mm_s: moves.velocity_mm_s.min(most_mm_s),
            ..moves
        }),
    };
    SMALL_MOTIONS.iter().map(fit).collect()
}

impl SmallMotion {
    /// Distance from one turn to the next, mm.
    pub(super) const fn stroke_mm(self) -> f64 {
        match self {
            Self::Sine(sine, _) => 2.0 * sine.amplitude_mm,
            Self::Moves(moves) => moves.distance_mm,
        }
    }

    /// Largest velocity, mm/s.
    pub(super) const fn velocity_mm_s(self) -> f64 {
        match self {
            Self::Sine(sine, _) => sine.velocity_mm_s,
            Self::Moves(moves) => moves.velocity_mm_s,
        }
    }

    /// Time of a run, s.
    pub(super) fn lasts_s(self) -> f64 {
        match self {
            Self::Sine(sine, cycles) => one_lasts_s(&sine, cycles),
            Self::Moves(moves) => {
                let moving_s = moves.distance_mm / moves.velocity_mm_s;
                2.0 * PAIRS as f64 * (moving_s + REST_S)
            }
        }
    }

    /// Runs the settings in force on it: the largest error, mm.
    ///
    /// # Errors
    /// A run that is stopped.
    pub(super) fn run(
        self,
        test_axis: &mut dyn TestAxis,
        law: &str,
        progress: &mut dyn FnMut(f64),
    ) -> Result<f64, ExperimentError> {
        match self {
            Self::Sine(sine, cycles) => {
                let (score, _) = run_cycles(test_axis, law, sine, cycles, progress)?;
                Ok(score.largest_mm)
            }
            Self::Moves(moves) => run_moves(test_axis, law, moves, progress),
        }
    }
}

impl fmt::Display for SmallMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sine(sine, _) => {
                let (amplitude_mm, velocity_mm_s) = (sine.amplitude_mm, sine.velocity_mm_s);
                write!(f, "{amplitude_mm:.2} mm at {velocity_mm_s:.1} mm/s")
            }
            Self::Moves(Moves {
                distance_mm,
                velocity_mm_s,
            }) => write!(f, "moves of {distance_mm:.2} mm at {velocity_mm_s:.1} mm/s"),
        }
    }
}

/// Runs the settings in force on moves to and fro, with the rests after them: the largest error, mm.
///
/// # Errors
/// A run that is stopped.
pub fn run_moves(
    test_axis: &mut dyn TestAxis,
    law: &str,
    moves: Moves,
    progress: &mut dyn FnMut(f64),
) -> Result<f64, ExperimentError> {
    let info = test_axis.info();
    let max_acceleration_mm_s2 = MOVE_MM_S2.min(MOST_ACCELERATION * info.max_acceleration_mm_s2);
    let rest = vec![0.0; (REST_S * info.rate_hz) as usize];
    let mut largest_mm = 0.0_f64;
    for index in 0..2 * PAIRS {
        let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
        let moving = MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: sign * moves.distance_mm,
            max_velocity_mm_s: moves.velocity_mm_s,
            max_acceleration_mm_s2,
            max_jerk_mm_s3: MOVE_JERK_PER_S * max_acceleration_mm_s2,
        });
        for (motion, injection_v) in [(moving, Vec::new()), (MotionSettings::Hold, rest.clone())] {
            let recording = test_axis.perform(
                &Experiment {
                    name: format!("{law} on moves of {:.3} mm", moves.distance_mm),
                    drive: Drive::ClosedLoop(motion),
                    injection_v,
                    decimation: 1,
                    time_limit_s: 60.0,
                },
                &mut |_| {},
            )?;
            let pairs = recording.reference_mm.iter().zip(&recording.position_mm);
            largest_mm = pairs.fold(largest_mm, |largest, (reference, position)| {
                largest.max((reference - position).abs())
            });
        }
        progress((index + 1) as f64 / (2 * PAIRS) as f64);
    }
    Ok(largest_mm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_small_motion_is_faster_than_the_axis() {
        let info = |max_velocity_mm_s| AxisInfo {
            name: "x",
            rate_hz: 1e4,
            resolution_mm: 1e-4,
            full_scale_v: 10.0,
            travel_mm: 30.0,
            start_mm: 0.0,
            max_velocity_mm_s,
            max_acceleration_mm_s2: 2000.0,
        };
        for most_mm_s in [1.0, 6.0, 10.0, 17.7] {
            for motion in small_motions(&info(most_mm_s)) {
                assert!(motion.velocity_mm_s() < most_mm_s, "{motion}: {most_mm_s}");
            }
        }
        for (asked, fitted) in SMALL_MOTIONS.iter().zip(small_motions(&info(200.0))) {
            let as_asked = *asked == fitted;
            assert!(
                as_asked || matches!(asked, SmallMotion::Sine(..)),
                "{fitted}"
            );
        }
    }
}
