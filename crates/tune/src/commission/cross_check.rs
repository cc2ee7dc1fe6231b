//! Cross-checks of a finished commissioning: the response at rest, which friction bends, and an ordinary motion.

use quadrant_law::safety::FaultCode;
use quadrant_settings::AxisSettings;

use super::bootstrap::measuring_settings;
use super::error::CommissionError;
use crate::identify::at_rest::AtRest;
use crate::identify::excitation::{Excitation, Waveform};
use crate::identify::frf;
use crate::identify::motion::{Candidate, MotionFitSettings, fit_motion, recommended, shuttle};
use crate::identify::response::FrequencyResponse;
use crate::identify::revise::{ReviseError, Revision};
use crate::record::Recording;
use crate::test_axis::{ExperimentError, TestAxis, approach};

/// Results of the cross-checks.
#[derive(Clone, Debug)]
pub struct CrossCheck {
    /// The response at rest.
    pub at_rest: FrequencyResponse,
    /// The linear model revised until it and the friction together show that response.
    pub revisions: Vec<Revision>,
    /// Models of an ordinary motion, the dead time being known.
    pub motion: Vec<Candidate>,
    /// The recordings: at rest, in motion.
    pub recordings: [Recording; 2],
}

/// Lowest frequencies of the excitation, Hz, each with its RMS over the friction at breakaway: one after the other, until the axis stays
/// within its bounds of way and velocity, and the linear model is found. With the first it slides most of the time.
const EXCITATIONS: [(f64, f64); 6] = [
    (4.0, 2.6),
    (10.0, 2.6),
    (25.0, 2.0),
    (60.0, 1.5),
    (25.0, 1.1),
    (60.0, 0.9),
];
/// Highest frequency of the excitation, Hz.
const HIGHEST_HZ: f64 = 400.0;
/// Period of the excitation, s.
const PERIOD_S: f64 = 0.5;
/// Periods of the excitation.
const PERIODS: usize = 12;

impl CrossCheck {
    /// Excites the axis at rest and moves it to and fro, under the feedback of finished settings; `progress` receives the step
    /// and the share.
    ///
    /// # Errors
    /// A run that is stopped, or data that yield no model.
    pub fn run(
        test_axis: &mut dyn TestAxis,
        settings: &AxisSettings,
        seed: u64,
        progress: &mut dyn FnMut(&'static str, f64),
    ) -> Result<Self, CommissionError> {
        let plant = settings.plant.ok_or(ReviseError::NoResponse)?;
        let sliding = &settings.friction.sliding;
        let breakaway_v =
            0.5 * (sliding.positive.curve.breakaway_v + sliding.negative.curve.breakaway_v);
        let highest_hz = HIGHEST_HZ.min(frf::BAND_SHARE * test_axis.info().rate_hz);
        let excitation = |(lowest_hz, ratio)| Excitation {
            waveform: Waveform::Multisine,
            rms_v: ratio * breakaway_v,
            band_hz: (lowest_hz, highest_hz),
            rise_hz: 0.0,
            period_s: PERIOD_S,
            seed,
        };
        let mut measure = |tried| {
            test_axis.apply(&measuring_settings(settings))?;
            approach(test_axis, 0.0)?;
            let at_rest = AtRest::measure(
                test_axis,
                settings,
                excitation(tried),
                PERIODS,
                &mut |share| {
                    progress("response at rest", share);
                },
            )?;
            progress("revising the linear model", 0.0);
            Ok((at_rest.revise(&plant)?, at_rest))
        };
        let strayed = |error: &ExperimentError| {
            let too_far = [FaultCode::InjectionBounds, FaultCode::EncoderJump];
            error.strayed() || error.fault().is_some_and(|fault| too_far.contains(&fault))
        };
        let mut found = Err(ReviseError::NoResponse);
        for tried in EXCITATIONS {
            found = measure(tried);
            match &found {
                Err(ReviseError::Experiment(error)) if strayed(error) => {}
                Err(ReviseError::Fit(_)) => {}
                _ => break,
            }
        }
        let (revisions, at_rest) = found?;

        approach(test_axis, 0.0)?;
        let moved = shuttle(test_axis, 1, &mut |share| {
            progress("ordinary motion", share)
        })?;
        let motion = MotionFitSettings {
            dead_time_s: Some(plant.delay_s + 0.5 * moved.sample_time_s),
            ..MotionFitSettings::default()
        };
        let motion = fit_motion(&moved, &motion, &|_| {})?;

        Ok(Self {
            at_rest: at_rest.response()?,
            revisions,
            motion,
            recordings: [at_rest.recording, moved],
        })
    }

    /// A of the ordinary motion over that of the settings' model; nothing when the motion yields none.
    pub fn inertia_agreement(&self, settings: &AxisSettings) -> Option<f64> {
        let found = recommended(&self.motion)?;
        let plant = settings.plant?;
        Some(1.0 / (found.model.inertia_v_s2_per_mm * plant.gain_mm_per_v_s2))
    }
}
