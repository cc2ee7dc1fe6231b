//! The response of an axis at rest, where friction bends it: measured, and as a model with friction predicts it.

use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::reference::MotionSettings;
use quadrant_settings::AxisSettings;

use super::excitation::Excitation;
use super::frf::{FrfSettings, SavedSettings, response_of, standstill};
use super::response::FrequencyResponse;
use super::revise::{
    ExplicitFriction, Measurement, ReviseError, Revision, candidate, revise, simulated_response,
};
use crate::commission::bootstrap::measuring_settings;
use crate::record::Recording;
use crate::test_axis::{Drive, Experiment, TestAxis};

/// An excitation at rest, and what it gave.
#[derive(Clone, Debug)]
pub struct AtRest {
    pub excitation: Excitation,
    /// The settings in force: the axis' own feedback, without feedforward.
    settings: AxisSettings,
    experiment: Experiment,
    /// Rate of the control law, Hz.
    rate_hz: f64,
    pub recording: Recording,
}

/// Lowest coherence of a line that a revision counts: with friction no response is quite coherent.
const LEAST_COHERENCE: f64 = 0.8;

/// Largest relative difference of two rates that count as equal.
const MAX_RATE_DIFFERENCE: f64 = 1e-3;

impl AtRest {
    /// Excites the axis at rest under the feedback of `settings`, for `periods` periods.
    ///
    /// # Errors
    /// Settings that are refused, or a run that is stopped.
    pub fn measure(
        test_axis: &mut dyn TestAxis,
        settings: &AxisSettings,
        excitation: Excitation,
        periods: usize,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, ReviseError> {
        let settings = measuring_settings(settings);
        test_axis.apply(&settings)?;
        let request = FrfSettings {
            excitation,
            periods,
            bias_velocity_mm_s: 0.0,
            open_loop: false,
            two_sided: false,
            ..FrfSettings::default()
        };
        let rate_hz = test_axis.info().rate_hz;
        let mut experiment = standstill(&request, rate_hz);
        let recording = test_axis.perform(&experiment, progress)?;
        // A model is run as the axis was: the test_axis may have recorded more coarsely.
        experiment.decimation = (recording.sample_time_s * rate_hz).round() as usize;
        Ok(Self {
            excitation,
            settings,
            experiment,
            rate_hz,
            recording,
        })
    }

    /// A saved recording of such an excitation, made under the feedback of `settings` at their control rate; the
    /// excitation is that which the recording holds, its period and band are stated.
    ///
    /// # Errors
    /// A recording at another rate, or without a response.
    pub fn saved(
        recording: Recording,
        settings: &AxisSettings,
        rate_hz: f64,
        excitation: Excitation,
    ) -> Result<Self, ReviseError> {
        if (recording.sample_time_s * rate_hz - 1.0).abs() > MAX_RATE_DIFFERENCE {
            return Err(ReviseError::Rate {
                recorded_hz: recording.sample_time_s.recip(),
                rate_hz,
            });
        }
        let saved = Self {
            excitation,
            settings: measuring_settings(settings),
            experiment: Experiment {
                name: "the saved excitation".to_owned(),
                drive: Drive::ClosedLoop(MotionSettings::Hold),
                injection_v: recording.injection_v.clone(),
                decimation: 1,
                time_limit_s: 10.0 + 2.0 * recording.duration_s(),
            },
            rate_hz,
            recording,
        };
        saved.response()?;
        Ok(saved)
    }

    /// The response of a recording of this experiment.
    pub fn estimate(&self, recording: &Recording) -> Option<FrequencyResponse> {
        let settings = SavedSettings {
            period_s: self.excitation.period_s,
            band_hz: self.excitation.band_hz,
            settling_s: 0.0,
        };
        let found = response_of(vec![recording.clone()], &settings).ok()?;
        Some(found.estimate.response)
    }

    /// The measured response.
    ///
    /// # Errors
    /// A recording without one.
    pub fn response(&self) -> Result<FrequencyResponse, ReviseError> {
        self.estimate(&self.recording)
            .ok_or(ReviseError::NoResponse)
    }

    /// The linear model revised for each kind of explicit friction. The model and the friction are those of the settings.
    ///
    /// # Errors
    /// Settings without a model, or a revision that fails.
    pub fn revise(&self, original: &PlantModel) -> Result<Vec<Revision>, ReviseError> {
        self.with_measurement(|measurement| revise(measurement, original, &self.settings.friction))
    }

    /// The response that a linear model with the settings' friction shows to this excitation.
    ///
    /// # Errors
    /// A model that cannot be run as the axis was.
    pub fn predict(
        &self,
        plant: &PlantModel,
        kind: ExplicitFriction,
    ) -> Result<FrequencyResponse, ReviseError> {
        let truth = candidate(plant, &self.settings.friction, kind, &self.settings);
        self.with_measurement(|measurement| simulated_response(measurement, truth))
    }

    fn with_measurement<T>(&self, use_it: impl FnOnce(&Measurement<'_>) -> T) -> T {
        use_it(&Measurement {
            experiment: &self.experiment,
            rate_hz: self.rate_hz,
            settings: &self.settings,
            recording: &self.recording,
            estimate: &|recording| self.estimate(recording),
            least_coherence: LEAST_COHERENCE,
        })
    }
}
