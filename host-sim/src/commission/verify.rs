//! Sine tests of the commissioned settings on the axis itself, measured by its own encoder.

use quadrant::feedforward::FeedforwardKind;
use quadrant::reference::{HarmonicSettings, MotionSettings};
use quadrant::settings::{AxisSettings, SettingsError};

use super::bootstrap::measuring_settings;
use crate::experiment::metrics::{Score, score};
use crate::experiment::sine_test::SineTest;
use crate::machine::{Drive, Experiment, ExperimentError, TestAxis};
use crate::record::Recording;

/// The sine on which settings are judged: the middle velocity of the thesis, on a travel that every axis has.
pub const SINE: SineTest = SineTest {
    amplitude_mm: 5.0,
    velocity_mm_s: 10.0,
};

/// Score of one law on the sine.
#[derive(Clone, Debug)]
pub struct SineResult {
    /// Name of the law.
    pub law: &'static str,
    /// Its score, on the measured position.
    pub score: Score,
    /// Recording of the scored cycles.
    pub recording: Recording,
}

/// Cycles at full speed, of which the last [`SCORED_CYCLES`] count.
const CYCLES: f64 = 3.25;
/// Cycles that are scored.
const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// Reason why the sine cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The settings are refused.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The run was stopped.
    #[error(transparent)]
    TestAxis(#[from] ExperimentError),
}

/// Runs the PID alone, the N-PID alone, and `settings` as they are, on a sine.
///
/// # Errors
/// Refused settings, or a run that is stopped.
pub fn verify(
    test_axis: &mut dyn TestAxis,
    settings: &AxisSettings,
    sine_test: SineTest,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<SineResult>, VerifyError> {
    let pid = measuring_settings(settings);
    let npid = AxisSettings {
        feedback: settings.feedback.clone(),
        ..pid.clone()
    };
    let mut full = settings.clone();
    full.feedforward.kind = FeedforwardKind::Combined;
    let laws = [
        ("PID", pid),
        ("N-PID", npid),
        ("N-PID + static + GMS", full),
    ];
    let mut results = Vec::new();
    for (index, (law, settings)) in laws.into_iter().enumerate() {
        test_axis.apply(&settings)?;
        let share = |done: f64| (index as f64 + done) / 3.0;
        results.push(run(test_axis, law, sine_test, &mut |done| {
            progress(share(done))
        })?);
    }
    Ok(results)
}

fn run(
    test_axis: &mut dyn TestAxis,
    law: &'static str,
    sine_test: SineTest,
    progress: &mut dyn FnMut(f64),
) -> Result<SineResult, VerifyError> {
    let sine = HarmonicSettings::with_velocity(
        sine_test.amplitude_mm,
        sine_test.velocity_mm_s,
        CYCLES,
        LEAD_S,
    );
    let recording = test_axis.perform(
        &Experiment {
            name: format!("{law} on a sine of {} mm", sine_test.amplitude_mm),
            drive: Drive::ClosedLoop(MotionSettings::Harmonic(sine)),
            injection_v: Vec::new(),
            decimation: 1,
            time_limit_s: 60.0 + 2.0 * CYCLES / sine.frequency_hz,
        },
        progress,
    )?;
    let samples = |seconds: f64| (seconds / recording.sample_time_s).round() as usize;
    let cycle = samples(1.0 / sine.frequency_hz);
    // The recording ends with the lead-out, whose end is a little later than the last full-speed cycle's.
    let end = recording.len() - samples(LEAD_S);
    let scored = recording.slice(end.saturating_sub(SCORED_CYCLES * cycle)..end);
    let errors: Vec<f64> = scored
        .reference_mm
        .iter()
        .zip(&scored.position_mm)
        .map(|(reference, position)| reference - position)
        .collect();
    Ok(SineResult {
        law,
        score: score(&scored.reference_mm, &errors, cycle),
        recording: scored,
    })
}
