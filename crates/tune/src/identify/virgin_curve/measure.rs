//! The experiment: a slow sine of small amplitude.

use quadrant_law::reference::{HarmonicSettings, MotionSettings};

use crate::record::Recording;
use crate::test_axis::{Drive, Experiment, ExperimentError, TestAxis};

/// Parameters of the hysteresis measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirginCurveSettings {
    /// Amplitude of the reference, mm: it must carry the axis through its pre-sliding range and, before that, the
    /// controller to the voltage at which the axis breaks away.
    pub amplitude_mm: f64,
    pub frequency_hz: f64,
    /// Cycles at full speed.
    pub cycles: f64,
}

impl Default for VirginCurveSettings {
    /// The thesis' 10 um at 0.1 Hz.
    fn default() -> Self {
        Self {
            amplitude_mm: 0.010,
            frequency_hz: 0.1,
            cycles: 3.0,
        }
    }
}

/// Amplitude over the tracking error at which the axis breaks away.
const AMPLITUDE_RATIO: f64 = 2.0;

impl VirginCurveSettings {
    /// The usual sine with an amplitude that outruns a controller of proportional gain `kp_v_per_mm` on an axis that breaks
    /// away at `breakaway_v`.
    pub fn outrunning(kp_v_per_mm: f64, breakaway_v: f64) -> Self {
        Self {
            amplitude_mm: AMPLITUDE_RATIO * breakaway_v / kp_v_per_mm,
            ..Self::default()
        }
    }
}

impl VirginCurveSettings {
    /// Time of the run, s.
    pub fn lasts_s(&self) -> f64 {
        (self.cycles + 1.0) / self.frequency_hz
    }
}

/// Rate of the recording, Hz.
const RATE_HZ: f64 = 1000.0;

/// Measures the hysteresis on the axis under test, under the settings that are in force.
///
/// # Errors
/// A run that is stopped.
pub fn measure(
    test_axis: &mut dyn TestAxis,
    settings: &VirginCurveSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Recording, ExperimentError> {
    let lead_s = 0.5 / settings.frequency_hz;
    let duration_s = settings.lasts_s();
    test_axis.perform(
        &Experiment {
            name: format!("hysteresis over {:.1} um", 1e3 * settings.amplitude_mm),
            drive: Drive::ClosedLoop(MotionSettings::Harmonic(HarmonicSettings {
                amplitude_mm: settings.amplitude_mm,
                frequency_hz: settings.frequency_hz,
                phase_rad: 0.0,
                cycles: Some(settings.cycles),
                lead_s,
            })),
            injection_v: Vec::new(),
            decimation: ((test_axis.info().rate_hz / RATE_HZ) as usize).max(1),
            time_limit_s: 20.0 + 2.0 * duration_s,
        },
        progress,
    )
}
