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
/// A small slow sine, and the cycles of it that are scored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SmallSine {
    pub(super) sine: SineTest,
    pub(super) scored_cycles: usize,
}

const fn small(amplitude_mm: f64, velocity_mm_s: f64, scored_cycles: usize) -> SmallSine {
    SmallSine {
        sine: SineTest {
            amplitude_mm,
            velocity_mm_s,
        },
        scored_cycles,
    }
}

/// Small slow sines, on which no law may be worse than the PID. What throws a table behind a spring depends on the frequency: the short
/// sines are at 3 to 12 Hz, and many of their cycles count, for an axis that sticks does not do the same in each. The last ones are slow, or
/// longer at a moderate speed: they show an axis that meets less friction at such a speed than is fed forward.
pub(super) const SMALL_SINES: [SmallSine; 17] = [
    small(0.02, 0.6, 9),
    small(0.02, 0.9, 9),
    small(0.02, 1.2, 9),
    small(0.03, 0.9, 9),
    small(0.03, 1.4, 9),
    small(0.05, 1.0, 9),
    small(0.05, 1.4, 9),
    small(0.02, 1.55, 9),
    small(0.08, 1.45, 9),
    small(0.15, 1.55, 5),
    small(0.02, 0.35, 9),
    small(0.1, 0.35, 3),
    small(0.18, 0.2, 1),
    small(0.7, 0.85, 2),
    small(0.6, 0.45, 1),
    small(0.8, 1.1, 2),
    small(0.9, 0.2, 1),
];
/// Number of the small sines, the short ones, on which a law has to keep its margin: there the table is thrown by what is fed forward
/// beyond its friction.
pub(super) const MARGIN_SINES: usize = 7;
/// Largest amplitude of a sine over the travel.
const MOST_TRAVEL: f64 = 0.4;
/// Largest velocity of a sine over the velocity limit.
const MOST_VELOCITY: f64 = 0.5;

/// Acceleration of a sine over the acceleration limit: it has more where it begins and ends.
const MOST_ACCELERATION: f64 = 0.6;

/// The sines that fit an axis.
pub fn sines(info: &AxisInfo) -> Vec<SineTest> {
    SINES.iter().map(|sine| fitted(*sine, info)).collect()
}

/// The small slow sines that fit an axis.
pub(super) fn small_sines(info: &AxisInfo) -> Vec<SmallSine> {
    SMALL_SINES
        .iter()
        .map(|small| SmallSine {
            sine: fitted(small.sine, info),
            ..*small
        })
        .collect()
}

fn fitted(sine: SineTest, info: &AxisInfo) -> SineTest {
    let sine = sine.within(MOST_TRAVEL * info.travel_mm);
    let accelerated_mm_s =
        (MOST_ACCELERATION * info.max_acceleration_mm_s2 * sine.amplitude_mm).sqrt();
    let most_mm_s = (MOST_VELOCITY * info.max_velocity_mm_s).min(accelerated_mm_s);
    SineTest {
        velocity_mm_s: sine.velocity_mm_s.min(most_mm_s),
        ..sine
    }
}

/// Cycles at full speed before those that are scored.
const UNSCORED_CYCLES: f64 = 1.25;
/// Cycles that are scored on the usual sines.
pub(super) const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// Cycles at full speed of a run whose last ones are scored.
fn cycles(scored_cycles: usize) -> f64 {
    UNSCORED_CYCLES + scored_cycles as f64
}

/// Time of one run on a sine, s.
pub(super) fn one_lasts_s(sine: &SineTest, scored_cycles: usize) -> f64 {
    let frequency_hz = sine.velocity_mm_s / (TAU * sine.amplitude_mm);
    cycles(scored_cycles) / frequency_hz + 2.0 * LEAD_S
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
    run_cycles(test_axis, law, sine_test, SCORED_CYCLES, progress)
}

/// [`run_sine`] over a number of scored cycles.
///
/// # Errors
/// A run that is stopped.
pub fn run_cycles(
    test_axis: &mut dyn TestAxis,
    law: &str,
    sine_test: SineTest,
    scored_cycles: usize,
    progress: &mut dyn FnMut(f64),
) -> Result<(Score, Recording), ExperimentError> {
    let sine = HarmonicSettings::with_velocity(
        sine_test.amplitude_mm,
        sine_test.velocity_mm_s,
        cycles(scored_cycles),
        LEAD_S,
    );
    let recording = test_axis.perform(
        &Experiment {
            name: format!("{law} on a sine of {:.2} mm", sine_test.amplitude_mm),
            drive: Drive::ClosedLoop(MotionSettings::Harmonic(sine)),
            injection_v: Vec::new(),
            decimation: 1,
            time_limit_s: 60.0 + 2.0 * cycles(scored_cycles) / sine.frequency_hz,
        },
        progress,
    )?;
    let samples = |seconds: f64| (seconds / recording.sample_time_s).round() as usize;
    let cycle = samples(1.0 / sine.frequency_hz);
    // The recording ends with the lead-out, whose end is a little later than the last full-speed cycle's.
    let end = recording.len() - samples(LEAD_S);
    let scored = recording.slice(end.saturating_sub(scored_cycles * cycle)..end);
    let errors: Vec<f64> = scored
        .reference_mm
        .iter()
        .zip(&scored.position_mm)
        .map(|(reference, position)| reference - position)
        .collect();
    Ok((score(&scored.reference_mm, &errors, cycle), scored))
}
