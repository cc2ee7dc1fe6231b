//! A program of moves of every length, given from elsewhere: as with LinuxCNC, the law does not know where a move will end.

use std::iter;

use quadrant_law::axes::AxisName;
use quadrant_law::reference::{MotionScale, MotionSettings, PointToPointSettings};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::given_run::{GivenReference, GivenRun};
use quadrant_sim::plant::{AxisParameters, StageParameters};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::plant::log_uniform;
use super::subject::Subject;

/// Moves of the program.
const MOVES: usize = 40;
/// Shortest and longest move, mm; the latter where the travel is long enough.
const LENGTHS_MM: (f64, f64) = (0.02, 10.0);
/// Largest velocities of the moves, mm/s.
const VELOCITIES_MM_S: (f64, f64) = (0.3, 40.0);
/// Time that a move takes at most, s.
const LONGEST_S: f64 = 4.0;
/// Rests after a move, s, each as likely as another.
const RESTS_S: [f64; 4] = [0.0, 0.02, 0.2, 1.5];
/// Rest before the first move, s.
const BEFORE_S: f64 = 0.3;
/// Largest distance from the middle over the travel; the longest move is one, too.
const MOST_TRAVEL: f64 = 0.4;
/// Largest acceleration, mm/s².
const MOST_MM_S2: f64 = 400.0;
/// Largest velocity and acceleration over the settings' limits.
const MOST_OF_LIMITS: f64 = 0.6;
/// Jerk over the acceleration, 1/s.
const JERK_PER_S: f64 = 100.0;

/// The reference: positions, mm, with velocities, mm/s, and accelerations, mm/s².
#[derive(Default)]
struct Program {
    positions_mm: Vec<f64>,
    derivatives: Vec<(f64, f64)>,
}

impl Program {
    /// The program of a subject.
    fn of(subject: &Subject, settings: &AxisSettings, scale: MotionScale) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(!subject.seed);
        let most_mm = LENGTHS_MM.1.min(MOST_TRAVEL * subject.travel.half_mm());
        let most_mm_s2 = MOST_MM_S2.min(MOST_OF_LIMITS * settings.limits.max_acceleration_mm_s2);
        let fastest_mm_s = VELOCITIES_MM_S
            .1
            .min(MOST_OF_LIMITS * settings.limits.max_velocity_mm_s);
        let mut program = Self::default();
        program.rest(BEFORE_S, scale);
        for _ in 0..MOVES {
            let length_mm = log_uniform(&mut random, LENGTHS_MM.0, most_mm);
            let slowest_mm_s = VELOCITIES_MM_S.0.max(length_mm / LONGEST_S);
            let max_velocity_mm_s =
                log_uniform(&mut random, slowest_mm_s.min(fastest_mm_s), fastest_mm_s);
            let sign = if random.random::<bool>() { 1.0 } else { -1.0 };
            let is_beyond = (program.here_mm() + sign * length_mm).abs() > most_mm;
            program.append(
                &PointToPointSettings {
                    distance_mm: if is_beyond { -sign } else { sign } * length_mm,
                    max_velocity_mm_s,
                    max_acceleration_mm_s2: most_mm_s2,
                    max_jerk_mm_s3: JERK_PER_S * most_mm_s2,
                },
                scale,
            );
            program.rest(RESTS_S[random.random_range(0..RESTS_S.len())], scale);
        }
        program
    }

    fn here_mm(&self) -> f64 {
        self.positions_mm.last().copied().unwrap_or_default()
    }

    fn rest(&mut self, seconds: f64, scale: MotionScale) {
        let (here_mm, ticks) = (self.here_mm(), (seconds * scale.rate_hz) as usize);
        self.positions_mm.extend(iter::repeat_n(here_mm, ticks));
        self.derivatives.extend(iter::repeat_n((0.0, 0.0), ticks));
    }

    fn append(&mut self, motion: &PointToPointSettings, scale: MotionScale) {
        let here_mm = self.here_mm();
        let motion = MotionSettings::PointToPoint(*motion);
        for sample in GivenReference::of_motion(&motion, scale, usize::MAX).samples() {
            let moved_mm = sample.position.to_mm(scale.resolution_mm);
            self.positions_mm.push(here_mm + moved_mm);
            self.derivatives
                .push((sample.velocity.into(), sample.acceleration.into()));
        }
    }
}

/// Largest error of an axis with some parameters on its program under settings, mm; `seed` decides the noise.
pub(super) fn largest_mm(
    settings: &AxisSettings,
    parameters: AxisParameters,
    subject: &Subject,
    seed: u64,
) -> Result<f64, String> {
    let mut stage = StageSettings::simulated();
    let scale = MotionScale::new(parameters.resolution_mm, stage.rate_hz);
    let program = Program::of(subject, settings, scale);
    let derivatives = program.derivatives.iter().copied();
    let reference = GivenReference::with(&program.positions_mm, derivatives, scale);
    stage.axes[0] = settings.clone();
    let mut truth = StageParameters::real();
    truth.axes[0] = parameters;
    let mut run = GivenRun::of_axis(&stage, &truth, AxisName::X, reference, seed)
        .map_err(|error| error.to_string())?;
    run.advance(usize::MAX).map_err(|error| error.to_string())?;
    let traces = run.into_traces();
    let pairs = traces[0].reference_mm.iter().zip(&traces[0].position_mm);
    Ok(pairs.fold(0.0, |largest, (reference, position)| {
        f64::max(largest, (reference - position).abs())
    }))
}
