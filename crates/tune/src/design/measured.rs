//! A loop closed around a measured frequency response, without a model.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use quadrant_law::control::pid::PidGains;
use quadrant_settings::response::LinearResponse;
use quadrant_sim::loop_shape::{OpenLoop, controller_response};

use super::form::Form;
use crate::identify::response::{FrequencyResponse, ResponsePoint};

/// A measured response of which the trustworthy lines are kept, to be read at any frequency of its band.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredResponse {
    omega_rad_s: Vec<f64>,
    log_gain: Vec<f64>,
    phase_rad: Vec<f64>,
}

/// Reasons for which a measured response carries no design.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeasuredError {
    /// Too few coherent lines.
    #[error(
        "{lines} lines of the response have a coherence of at least {least_coherence}, and a design takes {LEAST_LINES}: measure with \
         more excitation or more averages"
    )]
    Incoherent {
        lines: usize,
        /// The coherence asked for.
        least_coherence: f64,
    },
    /// A hole that the loop might hide something in.
    #[error(
        "the response has no coherent line between {from_hz:.1} and {to_hz:.1} Hz: too wide a gap to read the loop across"
    )]
    Gap {
        /// Its lower edge, Hz.
        from_hz: f64,
        /// Its upper edge, Hz.
        to_hz: f64,
    },
}

/// Fewest lines of a response.
const LEAST_LINES: usize = 20;
/// The largest ratio of neighbouring frequencies above the lowest few lines, which lie far apart on a log scale.
const LARGEST_RATIO: f64 = 1.6;
/// Largest gain of the open loop at the band's upper end: the gain is taken to fall from there on.
const MAX_END_GAIN: f64 = 0.5;

impl MeasuredResponse {
    /// Keeps the lines with at least a coherence of `least_coherence`, 0 to 1.
    ///
    /// # Errors
    /// Too few such lines, or a gap between them.
    pub fn new(response: &FrequencyResponse, least_coherence: f64) -> Result<Self, MeasuredError> {
        let kept: Vec<ResponsePoint> = response
            .points
            .iter()
            .filter(|point| point.coherence >= least_coherence)
            .copied()
            .collect();
        if kept.len() < LEAST_LINES {
            return Err(MeasuredError::Incoherent {
                lines: kept.len(),
                least_coherence,
            });
        }
        for pair in kept.windows(2) {
            let (from_hz, to_hz) = (pair[0].frequency_hz, pair[1].frequency_hz);
            if to_hz > LARGEST_RATIO * from_hz {
                return Err(MeasuredError::Gap { from_hz, to_hz });
            }
        }
        let kept = FrequencyResponse { points: kept };
        Ok(Self {
            phase_rad: kept
                .phase_deg()
                .iter()
                .map(|deg| deg.to_radians())
                .collect(),
            omega_rad_s: kept.points.iter().map(|p| TAU * p.frequency_hz).collect(),
            log_gain: kept.points.iter().map(|p| p.response.norm().ln()).collect(),
        })
    }

    /// The lowest and the highest line, Hz.
    pub fn band_hz(&self) -> (f64, f64) {
        let (first, last) = (self.omega_rad_s[0], self.omega_rad_s[self.lines() - 1]);
        (first / TAU, last / TAU)
    }

    pub fn lines(&self) -> usize {
        self.omega_rad_s.len()
    }

    /// The response at a frequency of the band, mm/V: log gain and phase run straight between lines, over the log of
    /// the frequency. Beyond the band, that at its end.
    pub fn at(&self, omega_rad_s: f64) -> Complex64 {
        let above = self
            .omega_rad_s
            .partition_point(|&omega| omega <= omega_rad_s);
        let low = above.clamp(1, self.lines() - 1) - 1;
        let span = (self.omega_rad_s[low + 1] / self.omega_rad_s[low]).ln();
        let share = ((omega_rad_s / self.omega_rad_s[low]).ln() / span).clamp(0.0, 1.0);
        let between = |values: &[f64]| values[low] + share * (values[low + 1] - values[low]);
        Complex64::from_polar(between(&self.log_gain).exp(), between(&self.phase_rad))
    }

    /// The first frequency at which the phase reaches -180 degrees, Hz.
    pub fn half_turn_hz(&self) -> Option<f64> {
        let above = self.phase_rad.iter().position(|&phase| phase <= -PI)?;
        (above > 0).then(|| self.omega_rad_s[above] / TAU)
    }
}

/// Measured response and PID. A sampled controller drives the axis through a hold, whose response is
/// `(1 - exp(-s Ts)) / (s Ts)`; what it folds back from above half the sampling rate is left out: with the response
/// of a mass it is a ten-thousandth of the whole at a tenth of that rate.
#[derive(Clone, Debug)]
pub struct MeasuredLoop<'a> {
    response: &'a MeasuredResponse,
    gains: PidGains,
    form: Form,
}

impl<'a> MeasuredLoop<'a> {
    /// The loop of a response and gains.
    pub fn new(response: &'a MeasuredResponse, gains: &PidGains, form: Form) -> Self {
        Self {
            response,
            gains: *gains,
            form,
        }
    }

    /// True if the loop's gain, times a factor, has fallen at the upper end of the band, so that nothing is to be feared above
    /// it but a resonance that was not measured.
    pub fn has_fallen(&self, factor: f64) -> bool {
        factor * self.response(self.band_rad_s().1).norm() < MAX_END_GAIN
    }
}

impl OpenLoop for MeasuredLoop<'_> {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        let process = self.response.at(omega_rad_s);
        match self.form {
            Form::Continuous => process * self.gains.response(omega_rad_s),
            Form::Sampled {
                sample_time_s,
                computation_delay_s,
            } => {
                let half = 0.5 * omega_rad_s * sample_time_s;
                let late_s = 0.5 * sample_time_s + computation_delay_s;
                let hold = Complex64::from_polar(half.sin() / half, -omega_rad_s * late_s);
                let z = Complex64::cis(omega_rad_s * sample_time_s);
                process * hold * controller_response(&self.gains, sample_time_s, z)
            }
        }
    }

    fn band_rad_s(&self) -> (f64, f64) {
        let (low, high) = self.response.band_hz();
        (TAU * low, TAU * high)
    }
}
