//! The frequency at which an axis oscillated, from the end of a recording.

use std::f64::consts::TAU;

use crate::record::Recording;

/// An oscillation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ringing {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, mm.
    pub amplitude_mm: f64,
    /// Share of the motion about its plan that it is, 0 to 1.
    pub share: f64,
}

impl Ringing {
    /// True if it is faster than the reference ever is, mm/s: then the axis moves to and fro in every period of it, as no ripple makes
    /// it do.
    pub(super) fn outruns(&self, fastest_mm_s: f64) -> bool {
        TAU * self.frequency_hz * self.amplitude_mm > fastest_mm_s
    }
}

/// Windows at the end of a recording that are examined, s: the oscillation grew before.
const WINDOWS_S: [f64; 4] = [0.02, 0.05, 0.15, 0.4];
/// Growths that are tried, 1/s.
const GROWTHS_PER_S: [f64; 4] = [0.0, 15.0, 40.0, 100.0];
/// Lowest and highest frequency that is tried, Hz.
const FREQUENCIES_HZ: (f64, f64) = (5.0, 900.0);
/// Number of frequencies, even on a log scale.
const FREQUENCIES: usize = 240;
/// Least periods in the window.
const LEAST_PERIODS: f64 = 2.0;
/// Least samples in a period.
const LEAST_SAMPLES: f64 = 4.0;
/// Least share of the motion that is called an oscillation.
const LEAST_SHARE: f64 = 0.5;
/// Least amplitude over the largest error: an axis that is stuck trembles, too.
const MIN_ERROR_SHARE: f64 = 0.1;
/// Largest number of samples that are examined.
const MOST_SAMPLES: usize = 1500;

/// The oscillation at the end of a recording, if one sine is most of the motion about a line.
pub fn ringing(recording: &Recording) -> Option<Ringing> {
    let found = WINDOWS_S.iter().filter_map(|&window_s| {
        let samples = (window_s / recording.sample_time_s) as usize;
        let begin = recording.len().saturating_sub(samples);
        let errors: Vec<f64> = recording.position_mm[begin..]
            .iter()
            .zip(&recording.reference_mm[begin..])
            .map(|(position, reference)| position - reference)
            .collect();
        let farthest_mm = errors
            .iter()
            .fold(0.0_f64, |most, error| most.max(error.abs()));
        let growths = GROWTHS_PER_S.iter();
        growths
            .filter_map(|&growth_per_s| largest(&errors, growth_per_s, recording.sample_time_s))
            .filter(|found| found.amplitude_mm > MIN_ERROR_SHARE * farthest_mm)
            .max_by(|a, b| score(a, window_s).total_cmp(&score(b, window_s)))
            .map(|found| (score(&found, window_s), found))
    });
    found
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, found)| found)
}

/// True if two oscillations have about the same frequency.
pub(super) fn alike(a: &Ringing, b: &Ringing) -> bool {
    (1.0 / SAME_FREQUENCY_RATIO..SAME_FREQUENCY_RATIO).contains(&(a.frequency_hz / b.frequency_hz))
}

/// The oscillation that lasts all through a recording, if there is one that is larger than some counts of the encoder.
pub(super) fn lasting(recording: &Recording, resolution_mm: f64) -> Option<Ringing> {
    let part = recording.len() / PARTS;
    let parts: Option<Vec<Ringing>> = (0..PARTS)
        .map(|index| ringing(&recording.slice(index * part..(index + 1) * part)))
        .collect();
    let parts = parts?;
    let first = parts[0];
    let lasts = parts.iter().all(|found| {
        alike(found, &first)
            && found.amplitude_mm > LEAST_COUNTS * resolution_mm
            && found.frequency_hz > LEAST_HZ
    });
    lasts.then_some(first)
}

/// Parts of a recording: an oscillation that lasts is found in each of them.
const PARTS: usize = 4;
/// Largest ratio of two frequencies that count as the same.
const SAME_FREQUENCY_RATIO: f64 = 1.3;
/// Lowest frequency of an oscillation that lasts, Hz.
const LEAST_HZ: f64 = 8.0;
/// Least amplitude of it, counts.
const LEAST_COUNTS: f64 = 4.0;

/// Worth of a find: few periods can look like much.
fn score(found: &Ringing, window_s: f64) -> f64 {
    found.share * (1.0 - 0.5 / (found.frequency_hz * window_s))
}

fn largest(errors: &[f64], growth_per_s: f64, sample_time_s: f64) -> Option<Ringing> {
    let every = errors.len().div_ceil(MOST_SAMPLES).max(1);
    let values: Vec<f64> = errors.iter().step_by(every).copied().collect();
    let step_s = sample_time_s * every as f64;
    let count = values.len();
    if count < 8 {
        return None;
    }
    // About a straight line: the axis may have drifted besides. Then as if it had not grown.
    let end_s = count as f64 * step_s;
    let values: Vec<f64> = detrended(&values)
        .iter()
        .enumerate()
        .map(|(index, value)| value * (growth_per_s * (end_s - index as f64 * step_s)).exp())
        .collect();
    let values = detrended(&values);
    let all: f64 = values.iter().map(|value| value * value).sum();
    let window_s = end_s;
    let mut best: Option<Ringing> = None;
    for index in 0..FREQUENCIES {
        let share = index as f64 / (FREQUENCIES - 1) as f64;
        let (low, high) = FREQUENCIES_HZ;
        let frequency_hz = low * (high / low).powf(share);
        if frequency_hz * window_s < LEAST_PERIODS || frequency_hz * step_s * LEAST_SAMPLES > 1.0 {
            continue;
        }
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (index, value) in values.iter().enumerate() {
            let (s, c) = (TAU * frequency_hz * index as f64 * step_s).sin_cos();
            cosine += value * c;
            sine += value * s;
        }
        let power = 2.0 * (cosine * cosine + sine * sine) / count as f64;
        let found = Ringing {
            frequency_hz,
            amplitude_mm: 2.0 * cosine.hypot(sine) / count as f64,
            share: power / all,
        };
        if best.is_none_or(|best| found.share > best.share) {
            best = Some(found);
        }
    }
    best.filter(|best| best.share > LEAST_SHARE)
}

/// Values about the straight line through them.
pub(super) fn detrended(values: &[f64]) -> Vec<f64> {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let about = |index: usize| index as f64 - middle;
    let moment: f64 = (0..values.len())
        .map(|i| about(i) * (values[i] - mean))
        .sum();
    let squares: f64 = (0..values.len()).map(|i| about(i) * about(i)).sum();
    let slope = moment / squares;
    let line = |index: usize| mean + slope * about(index);
    (0..values.len()).map(|i| values[i] - line(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grown oscillation on a drift, or a drift alone.
    fn recording(frequency_hz: f64, amplitude_mm: f64) -> Recording {
        let count = 5000;
        let time = |index: usize| index as f64 * 1e-4;
        Recording {
            sample_time_s: 1e-4,
            reference_mm: (0..count).map(|index| 10.0 * time(index)).collect(),
            position_mm: (0..count)
                .map(|index| {
                    let grown = amplitude_mm * (8.0 * (time(index) - 0.5)).exp();
                    12.0 * time(index) + grown * (TAU * frequency_hz * time(index)).sin()
                })
                .collect(),
            ..Recording::default()
        }
    }

    #[test]
    fn an_oscillation_outruns_a_slow_motion_that_it_turns_around_in_every_period() {
        let found = Ringing {
            frequency_hz: 100.0,
            amplitude_mm: 0.01,
            share: 1.0,
        };
        // 6.3 mm/s.
        assert!(found.outruns(6.0));
        assert!(!found.outruns(6.5));
    }

    #[test]
    fn the_frequency_of_an_oscillation_that_grew_is_found_and_a_drift_is_none() {
        for frequency_hz in [12.0, 31.0, 70.0, 200.0, 480.0] {
            let found = ringing(&recording(frequency_hz, 0.5)).unwrap();
            let error = found.frequency_hz / frequency_hz - 1.0;
            assert!(error.abs() < 0.15, "{frequency_hz} Hz: {found:?}");
        }
        assert_eq!(ringing(&recording(50.0, 0.0)), None);
    }
}
