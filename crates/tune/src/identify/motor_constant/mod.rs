//! The motor constant from an open-loop test (thesis, Fig 3.7).
//!
//! The voltage steps between two levels of one sign, so that the axis slides on and its friction stays the same: then
//! `y'' = A (u(t - Td) - F) - B y'`, which integrated twice is linear in A, B and A F. Nothing is differentiated. Passes
//! in both directions bring the axis back; their scatter is the uncertainty. An axis that rings with a structural mode of the
//! order of the levels' frequency scatters too much: then the motion of an oscillator is fitted with the rest. With the moving mass, `k_f = m A`.

mod levels;
mod mode;
mod passes;
mod settings;

use self::levels::{LevelSearch, went_too_far};
use self::mode::with_mode;
use self::passes::{Pass, find_passes};
pub use self::settings::MotorConstantSettings;
use self::settings::dwell;
use crate::record::Recording;
use crate::test_axis::{ExperimentError, TestAxis};

/// Result of the test.
#[derive(Clone, Debug)]
pub struct MotorConstant {
    /// A, acceleration per volt, mm/(V s^2).
    pub gain_mm_per_v_s2: f64,
    /// Its standard deviation, from the scatter over the passes.
    pub standard_error: f64,
    /// B, damping over mass, 1/s; rough.
    pub damping_per_s: f64,
    /// Friction in motion, V; rough, and zero or more.
    pub friction_v: f64,
    /// The same in positive and in negative direction, V, within shares of the level that it slides at: what hangs pulls one
    /// way. The mean where a direction is missing.
    pub directed_v: [f64; 2],
    /// Lower level of the voltage, V.
    pub level_v: f64,
    pub recording: Recording,
}

impl MotorConstant {
    /// k_f, N/V, of a moving mass in kg.
    pub fn force_n_per_v(&self, moving_mass_kg: f64) -> f64 {
        1e-3 * self.gain_mm_per_v_s2 * moving_mass_kg
    }

    /// Standard deviation of the encoder's noise, mm, from the quietest part of the test, in which the axis rests; by second
    /// differences, which leave out a motor that still swings on its spring. Zero of an encoder that shows whole counts and no noise.
    pub fn noise_mm(&self) -> f64 {
        let samples = ((RESTING_S / self.recording.sample_time_s) as usize).max(3);
        let parts = self.recording.position_mm.chunks_exact(samples);
        let squares = parts.map(|part| {
            let bends = part.windows(3).map(|p| p[0] - 2.0 * p[1] + p[2]);
            bends.map(|bend| bend * bend).sum::<f64>() / (samples - 2) as f64
        });
        let least = squares.fold(f64::INFINITY, f64::min);
        // A second difference adds three readings with weights of 1, 2 and 1.
        if least.is_finite() {
            (least / 6.0).sqrt()
        } else {
            0.0
        }
    }
}

/// Length of the parts of a test of which the quietest is at rest, s.
const RESTING_S: f64 = 0.02;

/// Reasons for which no motor constant was found.
#[derive(Debug, thiserror::Error)]
pub enum MotorConstantError {
    /// The axis does not slide.
    #[error(
        "the axis did not slide at {level_v} V: is the amplifier enabled, the brake off, the encoder connected? Else raise the largest level"
    )]
    Still {
        /// The largest level tried.
        level_v: f64,
    },
    /// A positive voltage moves the axis to smaller positions.
    #[error(
        "a positive voltage moves the axis to smaller positions: set amplifier.reversed or encoder.reversed, or swap two wires; under \
         feedback it would run away"
    )]
    Reversed,
    #[error(
        "the passes give {gain:.0} +- {standard_error:.0} mm/(V s^2): too uncertain; raise the levels' number or dwell"
    )]
    Uncertain { gain: f64, standard_error: f64 },
    /// The recording is no test.
    #[error(
        "the recording has {passes} passes in which the voltage steps between levels of one sign while the axis slides; the test takes 2"
    )]
    NoPasses { passes: usize },
    /// The run was stopped.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
}

/// Runs the test on the axis under test, with rising levels until the axis slides; gently where that goes too far or is too uncertain.
///
/// # Errors
/// An axis that does not slide, moves the wrong way, or is too uncertain; a run that is stopped.
pub fn measure(
    test_axis: &mut dyn TestAxis,
    settings: &MotorConstantSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<MotorConstant, MotorConstantError> {
    let search = LevelSearch::new(*settings, &test_axis.info());
    match search.run(test_axis, progress) {
        Err(MotorConstantError::Uncertain { .. }) => measure_gently(test_axis, settings, progress),
        Err(MotorConstantError::Experiment(error)) if went_too_far(&error) => {
            measure_gently(test_axis, settings, progress)
        }
        outcome => outcome,
    }
}

/// Runs the test with a voltage that rises first, to levels that are nearer to each other: for a motor that jumps on a soft spring.
///
/// # Errors
/// As [`measure`].
pub fn measure_gently(
    test_axis: &mut dyn TestAxis,
    settings: &MotorConstantSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<MotorConstant, MotorConstantError> {
    let search = LevelSearch::new(settings.gentle(), &test_axis.info());
    search.run(test_axis, progress)
}

/// Least friction in motion over the mean of the levels: the rest of the mean accelerates.
const LEAST_FRICTION: f64 = 0.457;
/// Largest friction in motion over the mean of the levels.
const MOST_FRICTION: f64 = 0.857;
/// Largest relative standard error.
const MOST_UNCERTAIN: f64 = 0.2;

/// Evaluates a recorded test.
///
/// # Errors
/// A recording without passes, of an axis that moves the wrong way, or too uncertain.
pub fn evaluate(
    recording: Recording,
    settings: &MotorConstantSettings,
    resolution_mm: f64,
) -> Result<MotorConstant, MotorConstantError> {
    let dwell = dwell(settings, 1.0 / recording.sample_time_s);
    let (mut found, spans): (Vec<Pass>, Vec<[usize; 3]>) =
        find_passes(&recording, settings, resolution_mm)?
            .into_iter()
            .unzip();
    if found.len() < 2 {
        return Err(MotorConstantError::NoPasses {
            passes: found.len(),
        });
    }
    let (mut gain, mut standard_error) = gain_of(&found);
    if is_uncertain(gain, standard_error)
        && let Some(resonant) = with_mode(&recording, &spans, dwell)
    {
        found = resonant;
        (gain, standard_error) = gain_of(&found);
    }
    let count = found.len() as f64;
    let mean = |read: fn(&Pass) -> f64| found.iter().map(read).sum::<f64>() / count;
    if is_uncertain(gain, standard_error) {
        return Err(MotorConstantError::Uncertain {
            gain,
            standard_error,
        });
    }
    let directed = |sign: f64| {
        let values: Vec<f64> = found
            .iter()
            .filter(|pass| pass.sign == sign)
            .map(|pass| pass.friction_v)
            .collect();
        let count = values.len();
        if count == 0 {
            return mean(|pass| pass.friction_v);
        }
        values.iter().sum::<f64>() / count as f64
    };
    // The axis slid on through the lower level, so that the mean overcame its friction.
    let level_of = |sign: f64| {
        let most = |most: f64, volts: &f64| most.max(sign * volts);
        recording.voltage_v.iter().fold(0.0, most) / settings.upper_ratio
    };
    let believable = |sign: f64| {
        let mean_v = settings.mean_ratio() * level_of(sign);
        directed(sign)
            .max(LEAST_FRICTION * mean_v)
            .min(MOST_FRICTION * mean_v)
    };
    Ok(MotorConstant {
        directed_v: [1.0, -1.0].map(believable),
        gain_mm_per_v_s2: gain,
        standard_error,
        damping_per_s: mean(|pass| pass.damping_per_s),
        friction_v: mean(|pass| pass.friction_v).max(0.0),
        level_v: level_of(1.0).max(level_of(-1.0)),
        recording,
    })
}

/// Mean of A over the passes, and its standard deviation.
fn gain_of(passes: &[Pass]) -> (f64, f64) {
    let count = passes.len() as f64;
    let gain = passes.iter().map(|pass| pass.gain).sum::<f64>() / count;
    let squares: f64 = passes.iter().map(|pass| (pass.gain - gain).powi(2)).sum();
    (gain, (squares / (count - 1.0) / count).sqrt())
}

/// True for an A that no controller can be made with.
fn is_uncertain(gain: f64, standard_error: f64) -> bool {
    !(gain > 0.0 && standard_error <= MOST_UNCERTAIN * gain)
}
