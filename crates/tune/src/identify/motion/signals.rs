//! From position and voltage to what a regression needs.

use super::model::Span;
use super::zero_phase::low_pass;
use crate::record::Recording;

/// Parameters of the preparation of a motion record, and of the models fitted to it.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionFitSettings {
    /// Cut-off of the position's low-pass, Hz: well above the motion, well below the noise of its second difference.
    pub cutoff_hz: f64,
    /// Time cut at each end, s.
    pub edge_s: f64,
    /// Rows kept a second, Hz: one sample in so many that this comes out.
    pub row_rate_hz: f64,
    /// Displacements at which Maxwell-slip elements may begin to slip, mm, ascending.
    pub knots_mm: Vec<f64>,
    /// Dead time from voltage to force if it is known from elsewhere, s, half a period of the voltage's hold included. A record
    /// of gentle motions hardly distinguishes it from inertia: it determines well only `M' + sigma Td`.
    pub dead_time_s: Option<f64>,
}

impl Default for MotionFitSettings {
    /// As EMPS is usually treated: 100 Hz, 50 ms, a row each 10 ms; knots from 2 to 50 um.
    fn default() -> Self {
        Self {
            cutoff_hz: 100.0,
            edge_s: 0.05,
            row_rate_hz: 100.0,
            knots_mm: vec![0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05],
            dead_time_s: None,
        }
    }
}

impl MotionFitSettings {
    /// Samples cut at each end.
    pub(super) fn edge_samples(&self, sample_time_s: f64) -> usize {
        (self.edge_s / sample_time_s).round() as usize
    }

    /// One sample in so many is kept.
    pub(super) fn decimation(&self, sample_time_s: f64) -> usize {
        ((sample_time_s * self.row_rate_hz).recip().round() as usize).max(1)
    }
}

/// The signals of a record before decimation, edges included.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Time from one sample to the next, s: the record's own up to some kilohertz.
    pub sample_time_s: f64,
    /// Half the time for which a voltage was held, s: by so much its effect is later than its sample.
    pub hold_s: f64,
    /// Position, filtered, mm.
    pub position_mm: Vec<f64>,
    /// Its first derivative, mm/s.
    pub velocity_mm_s: Vec<f64>,
    /// Its second derivative, mm/s².
    pub acceleration_mm_s2: Vec<f64>,
    /// Voltage, as recorded, V.
    pub voltage_v: Vec<f64>,
}

/// Least velocity of an axis that counts as moving, over the largest velocity.
const MIN_MOVING_SHARE: f64 = 0.01;
/// Sampling rate that always suffices, Hz.
const SUFFICIENT_RATE_HZ: f64 = 1000.0;
/// Order of the position's filter.
const ORDER: usize = 4;
/// Order of the decimation's filter.
const DECIMATION_ORDER: usize = 8;
/// Cut-off of this filter as a share of half the new rate.
const DECIMATION_SHARE: f64 = 0.9;

impl Signals {
    /// Filters and differentiates. A record of more than some kilohertz is thinned to one: nothing above that is used.
    pub fn new(recording: &Recording, settings: &MotionFitSettings) -> Self {
        let recorded_s = recording.sample_time_s;
        let thinning = ((SUFFICIENT_RATE_HZ * recorded_s).recip().floor() as usize).max(1);
        let period_s = recorded_s * thinning as f64;
        let thinned =
            |signal: &[f64]| -> Vec<f64> { signal.iter().copied().step_by(thinning).collect() };
        let position = low_pass(
            &recording.position_mm,
            recorded_s,
            settings.cutoff_hz,
            ORDER,
        );
        let voltage_v = if thinning == 1 {
            recording.voltage_v.clone()
        } else {
            let cutoff_hz = 0.5 * DECIMATION_SHARE / period_s;
            thinned(&low_pass(
                &recording.voltage_v,
                recorded_s,
                cutoff_hz,
                DECIMATION_ORDER,
            ))
        };
        let position_mm = thinned(&position);
        let velocity_mm_s = central_difference(&position_mm, period_s);
        let acceleration_mm_s2 = central_difference(&velocity_mm_s, period_s);
        Self {
            sample_time_s: period_s,
            hold_s: 0.5 * recorded_s,
            position_mm,
            velocity_mm_s,
            acceleration_mm_s2,
            voltage_v,
        }
    }

    /// Speed from which on the axis counts as moving, mm/s.
    pub(super) fn moving_mm_s(&self) -> f64 {
        let speeds = self.velocity_mm_s.iter().map(|v| v.abs());
        MIN_MOVING_SHARE * speeds.fold(0.0, f64::max)
    }

    /// Duration and travel of the record.
    pub(super) fn span(&self) -> Span {
        let positions = self.position_mm.iter();
        let (low, high) = positions.fold((f64::MAX, f64::MIN), |(low, high), &x| {
            (low.min(x), high.max(x))
        });
        let half_s = 0.5 * self.sample_time_s * self.position_mm.len() as f64;
        Span {
            time_s: (half_s, half_s),
            position_mm: (0.5 * (low + high), 0.5 * (high - low)),
        }
    }

    /// A signal without its edges, through the decimation filter, at the full rate still.
    pub(super) fn smoothed(&self, signal: &[f64], settings: &MotionFitSettings) -> Vec<f64> {
        let edge = settings.edge_samples(self.sample_time_s);
        let decimation = settings.decimation(self.sample_time_s);
        let inner = &signal[edge..signal.len() - edge];
        if decimation < 2 {
            return inner.to_vec();
        }
        let new_rate_hz = 1.0 / (self.sample_time_s * decimation as f64);
        let cutoff_hz = 0.5 * DECIMATION_SHARE * new_rate_hz;
        low_pass(inner, self.sample_time_s, cutoff_hz, DECIMATION_ORDER)
    }

    /// A signal without its edges, filtered and decimated.
    pub fn decimated(&self, signal: &[f64], settings: &MotionFitSettings) -> Vec<f64> {
        let decimation = settings.decimation(self.sample_time_s);
        let smoothed = self.smoothed(signal, settings);
        smoothed.into_iter().step_by(decimation).collect()
    }
}

/// Central differences; at the ends, the neighbour's.
fn central_difference(signal: &[f64], period_s: f64) -> Vec<f64> {
    let mut slope: Vec<f64> = signal
        .windows(3)
        .map(|w| (w[2] - w[0]) / (2.0 * period_s))
        .collect();
    if let (Some(&first), Some(&last)) = (slope.first(), slope.last()) {
        slope.insert(0, first);
        slope.push(last);
    }
    slope
}
