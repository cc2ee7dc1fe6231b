//! The sines that laws are tried on, and a run on one of them.

use std::f64::consts::TAU;

use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_sim::metrics::{Score, score};
use quadrant_sim::sine_test::SineTest;

use crate::record::Recording;
use crate::test_axis::{AxisInfo, Drive, Experiment, ExperimentError, TestAxis};

/// The sines on an axis with room: those by which a law is chosen, the middle velocity of the thesis first, then short, slow and fast;
/// and from [`CHOICE_SINES`] on, those that are withheld until then.
pub(super) const SINES: [SineTest; 7] = [
    SineTest {
        amplitude_mm: 5.0,
        velocity_mm_s: 10.0,
    },
    SineTest {
        amplitude_mm: 0.2,
        velocity_mm_s: 1.0,
    },
    SineTest {
        amplitude_mm: 1.0,
        velocity_mm_s: 2.0,
    },
    SineTest {
        amplitude_mm: 15.0,
        velocity_mm_s: 60.0,
    },
    SineTest {
        amplitude_mm: 3.0,
        velocity_mm_s: 4.0,
    },
    SineTest {
        amplitude_mm: 0.5,
        velocity_mm_s: 2.0,
    },
    SineTest {
        amplitude_mm: 8.0,
        velocity_mm_s: 25.0,
    },
];
/// Number of sines by which a law is chosen.
pub(super) const CHOICE_SINES: usize = 4;
/// Number of sines on which kinds of feedforward are compared; the best then runs on all [`CHOICE_SINES`].
pub(super) const COMPARISON_SINES: usize = 2;
/// Cycles of a sine at full speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycles {
    /// Those in which the axis forgets what was before.
    unscored: f64,
    /// Those that are scored after them.
    scored: usize,
}

impl Cycles {
    /// Scored cycles after those in which the axis settles.
    pub const fn scoring(scored: usize) -> Self {
        Self {
            unscored: 1.25,
            scored,
        }
    }

    /// The same of a slow sine, on which time is dear: from the reversal before the first scored one on.
    pub(super) const fn of_slow(scored: usize) -> Self {
        Self {
            unscored: 0.75,
            scored,
        }
    }

    /// Number of all of them.
    const fn all(self) -> f64 {
        self.unscored + self.scored as f64
    }
}

/// Largest amplitude of a sine over the travel.
const MOST_TRAVEL: f64 = 0.4;
/// Largest velocity of a sine over the velocity limit.
const MOST_VELOCITY: f64 = 0.5;

/// Acceleration of a sine over the acceleration limit: it has more where it begins and ends.
pub(super) const MOST_ACCELERATION: f64 = 0.6;

/// The sines that fit an axis.
pub fn sines(info: &AxisInfo) -> Vec<SineTest> {
    SINES.iter().map(|sine| fitted(*sine, info)).collect()
}

/// A sine as it fits an axis.
pub(super) fn fitted(sine: SineTest, info: &AxisInfo) -> SineTest {
    let sine = sine.within(MOST_TRAVEL * info.travel_mm);
    let accelerated_mm_s =
        (MOST_ACCELERATION * info.max_acceleration_mm_s2 * sine.amplitude_mm).sqrt();
    let most_mm_s = (MOST_VELOCITY * info.max_velocity_mm_s).min(accelerated_mm_s);
    SineTest {
        velocity_mm_s: sine.velocity_mm_s.min(most_mm_s),
        ..sine
    }
}

/// Cycles of the usual sines.
pub(super) const USUAL_CYCLES: Cycles = Cycles::scoring(2);
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// Time of one run on a sine, s.
pub(super) fn one_lasts_s(sine: &SineTest, cycles: Cycles) -> f64 {
    let frequency_hz = sine.velocity_mm_s / (TAU * sine.amplitude_mm);
    cycles.all() / frequency_hz + 2.0 * LEAD_S
}

/// Runs the settings in force on a sine: score and recording of the last whole cycles.
///
/// # Errors
/// A run that is stopped.
pub fn run_sine(
    test_axis: &mut dyn TestAxis,
    law: &str,
    sine_test: SineTest,
    progress: &mut dyn FnMut(f64),
) -> Result<(Score, Recording), ExperimentError> {
    run_cycles(test_axis, law, sine_test, USUAL_CYCLES, progress)
}

/// [`run_sine`] over other cycles.
///
/// # Errors
/// A run that is stopped.
pub fn run_cycles(
    test_axis: &mut dyn TestAxis,
    law: &str,
    sine_test: SineTest,
    cycles: Cycles,
    progress: &mut dyn FnMut(f64),
) -> Result<(Score, Recording), ExperimentError> {
    let sine = HarmonicSettings::with_velocity(
        sine_test.amplitude_mm,
        sine_test.velocity_mm_s,
        cycles.all(),
        LEAD_S,
    );
    let recording = test_axis.perform(
        &Experiment {
            name: format!("{law} on a sine of {:.2} mm", sine_test.amplitude_mm),
            drive: Drive::ClosedLoop(MotionSettings::Harmonic(sine)),
            injection_v: Vec::new(),
            decimation: 1,
            time_limit_s: 60.0 + 2.0 * cycles.all() / sine.frequency_hz,
        },
        progress,
    )?;
    let samples = |seconds: f64| (seconds / recording.sample_time_s).round() as usize;
    let cycle = samples(1.0 / sine.frequency_hz);
    // The recording ends with the lead-out, whose end is a little later than the last full-speed cycle's.
    let end = recording.len() - samples(LEAD_S);
    let scored = recording.slice(end.saturating_sub(cycles.scored * cycle)..end);
    let errors: Vec<f64> = scored
        .reference_mm
        .iter()
        .zip(&scored.position_mm)
        .map(|(reference, position)| reference - position)
        .collect();
    Ok((score(&scored.reference_mm, &errors, cycle), scored))
}
