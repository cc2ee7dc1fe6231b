//! The axis that laws run on, one sine after the other.

use quadrant_settings::AxisSettings;
use quadrant_sim::sine_test::SineTest;

use super::super::bootstrap::measuring_settings;
use super::super::ringing::{Ringing, lasting};
use super::VerifyError;
use super::law_result::LawResult;
use super::sines::{USUAL_CYCLES, one_lasts_s, run_cycles};
use super::small_motions::SmallMotion;
use crate::record::Recording;
use crate::test_axis::{ExperimentError, MachineError, TestAxis, approach};

/// Amplitude over the RMS error from which on an oscillation is most of the error: a reversal is followed by one, too, but it decays.
const MIN_DOMINANT_RATIO: f64 = 1.0;

/// Largest share of the trials that is reported: they may take longer than expected.
const MAX_PROGRESS: f64 = 0.99;

/// The axis that laws run on.
pub(super) struct Bench<'a> {
    pub(super) test_axis: &'a mut dyn TestAxis,
    pub(super) sines: &'a [SineTest],
    pub(super) small_motions: &'a [SmallMotion],
    pub(super) progress: &'a mut dyn FnMut(f64),
    /// Time for which the axis has run on motions, s.
    pub(super) used_s: f64,
    /// Time for which it does where the first choice is not worse than the PID anywhere, s.
    pub(super) expected_s: f64,
    /// True while oscillations are looked for, which takes longer than anything else here: of the PID alone.
    pub(super) detects_ringing: bool,
    /// The interruption by a person, after which nothing more runs.
    pub(super) interrupted: Option<ExperimentError>,
}

impl Bench<'_> {
    /// A law on the first sines; stops where the axis is stopped. Settings that are refused are an error.
    pub(super) fn try_law(
        &mut self,
        law: &str,
        settings: &AxisSettings,
        count: usize,
    ) -> Result<(LawResult, Option<ExperimentError>), MachineError> {
        let mut settings = settings.clone();
        // Room for the error that a poor law makes, as for the PID.
        let measuring = measuring_settings(&settings);
        settings.limits = measuring.limits;
        self.test_axis.apply(&settings)?;
        let mut result = LawResult {
            law: law.to_owned(),
            scores: Vec::new(),
            recording: Recording::default(),
            stopped: None,
            rings: Vec::new(),
            is_share: false,
            at_s: Vec::new(),
            settings,
        };
        let stopped = self.run(&mut result, count);
        Ok((result, stopped))
    }

    /// Runs a law that was not stopped on those of the first sines that it has not run on; the error that stops it.
    pub(super) fn run_on(
        &mut self,
        result: &mut LawResult,
        count: usize,
    ) -> Option<ExperimentError> {
        if result.stopped.is_some() || self.test_axis.apply(&result.settings).is_err() {
            return None;
        }
        self.run(result, count)
    }

    /// The same of one that was just put into force.
    fn run(&mut self, result: &mut LawResult, count: usize) -> Option<ExperimentError> {
        for index in result.scores.len()..count {
            let sine = self.sines[index];
            let lasts_s = one_lasts_s(&sine, USUAL_CYCLES);
            let ran = self.run_one(result, lasts_s, |test_axis, law, report| {
                run_cycles(test_axis, law, sine, USUAL_CYCLES, report)
            });
            let (score, recording) = match ran {
                Ok(ran) => ran?,
                Err(stopped) => return Some(stopped),
            };
            result.scores.push(score);
            result.at_s.push(self.used_s);
            if self.detects_ringing {
                let found = lasting(&recording, result.settings.encoder.resolution_mm);
                let is_all =
                    |found: &Ringing| found.amplitude_mm > MIN_DOMINANT_RATIO * score.rms_mm;
                result.rings.extend(found.filter(is_all));
            }
            if index == 0 {
                result.recording = recording;
            }
        }
        None
    }

    /// Runs settings under the name of a law on small slow motions, until one is `enough`: the largest errors, mm. They stay in force.
    ///
    /// # Errors
    /// A run that is stopped, and settings that are refused.
    pub(super) fn run_small(
        &mut self,
        result: &mut LawResult,
        settings: &AxisSettings,
        motions: &[SmallMotion],
        enough: impl Fn(usize, f64) -> bool,
    ) -> Result<Vec<f64>, VerifyError> {
        self.test_axis.apply(settings)?;
        let mut errors_mm = Vec::new();
        for (index, motion) in motions.iter().enumerate() {
            let ran = self.run_one(result, motion.lasts_s(), |test_axis, law, report| {
                motion.run(test_axis, law, report)
            });
            let Some(largest_mm) = ran? else {
                break;
            };
            errors_mm.push(largest_mm);
            if enough(index, largest_mm) {
                break;
            }
        }
        Ok(errors_mm)
    }

    /// Runs the law in force on a motion that lasts a time, s; nothing where a person has ended the trials. The error that stops it is kept.
    fn run_one<T>(
        &mut self,
        result: &mut LawResult,
        lasts_s: f64,
        run: impl FnOnce(&mut dyn TestAxis, &str, &mut dyn FnMut(f64)) -> Result<T, ExperimentError>,
    ) -> Result<Option<T>, ExperimentError> {
        if self.interrupted.is_some() {
            return Ok(None);
        }
        let (used_s, expected_s) = (self.used_s, self.expected_s);
        let progress = &mut *self.progress;
        let mut report =
            |share: f64| progress(((used_s + share * lasts_s) / expected_s).min(MAX_PROGRESS));
        let outcome = approach(self.test_axis, 0.0)
            .and_then(|()| run(self.test_axis, &result.law, &mut report));
        match outcome {
            Ok(ran) => {
                self.used_s += lasts_s;
                Ok(Some(ran))
            }
            Err(error @ ExperimentError::Interrupted { .. }) => {
                self.interrupted = Some(error);
                Ok(None)
            }
            Err(error) => {
                result.stopped = Some(error.to_string());
                Err(error)
            }
        }
    }
}
