//! The frequency response of saved recordings, of which only the signals and the excitation's period are known.
//!
//! What an experiment knows of itself is found in the signals: whether the loop was closed, where the axis was steady,
//! which lines were excited. The estimate is that of a fresh measurement.

use std::ops::Range;

use num_complex::Complex64;
use rayon::prelude::*;

use super::estimate::{Transform, estimates};
use super::{Estimator, FrfMeasurement};
use crate::identify::setting::SettingError;
use crate::record::Recording;

/// Parameters of the conversion of recordings into a response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SavedSettings {
    /// Period of the excitation, or half a block of a random one, s; at least 16 samples.
    pub period_s: f64,
    /// Lowest and highest frequency looked at, Hz.
    pub band_hz: (f64, f64),
    /// Time after the axis has become steady before the first block, s; 0 to 1000.
    pub settling_s: f64,
}

/// Reasons for which recordings give no response.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// A setting that cannot be.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The recordings were not sampled alike.
    #[error(
        "recording {index} has a sample time of {found_s} s, the first one {expected_s} s; resample it, or take it by itself"
    )]
    SampleTime {
        /// Number of the recording, from 1.
        index: usize,
        found_s: f64,
        /// That of the first.
        expected_s: f64,
    },
    #[error(
        "the recordings hold no injected voltage between {low_hz} and {high_hz} Hz; a response needs an excitation"
    )]
    NoExcitation { low_hz: f64, high_hz: f64 },
    /// Not enough to average.
    #[error(
        "{blocks} blocks of two periods of {period_s} s are steady, and a response takes at least 2: record longer, state a \
         shorter period, or give the column reference_mm of an axis that moved"
    )]
    TooShort { blocks: usize, period_s: f64 },
}

/// Periods in a block: the window then leaves the lines of a periodic excitation apart.
const BLOCK_PERIODS: usize = 2;
/// Fewest samples in a period.
const LEAST_PERIOD: usize = 16;
/// Least power of the injection at an excited line, over the power at the strongest one: -60 dB.
const MIN_LINE_POWER: f64 = 1e-6;
/// Largest power between the lines of the period, over the power at them, of a periodic excitation.
const MAX_APERIODIC_POWER: f64 = 1e-3;
/// Voltage beyond the injection, V RMS, from which on a feedback law was at work: some steps of a 16-bit converter.
const FEEDBACK_V: f64 = 1e-3;
/// Time over which the reference's velocity is looked at, s.
const VELOCITY_S: f64 = 0.01;
/// Largest deviation of the reference from its steady velocity, over that velocity.
const MAX_VELOCITY_DEVIATION: f64 = 1e-3;
/// Velocity below which the reference stands still, mm/s.
const STANDSTILL_MM_S: f64 = 1e-3;
/// Largest deviation of a time step from the first, over the first.
const MAX_STEP_DEVIATION: f64 = 1e-3;

/// Estimates the response of recordings made alike: the same axis, law, excitation and, but for its sign, velocity.
///
/// # Errors
/// Recordings that hold no excitation, are too short, or were not sampled alike.
pub fn response_of(
    recordings: Vec<Recording>,
    settings: &SavedSettings,
) -> Result<FrfMeasurement, SavedError> {
    let sample_time_s = check(&recordings, settings)?;
    let period = (settings.period_s / sample_time_s).round() as usize;
    let length = BLOCK_PERIODS * period;
    let closed_loop = recordings.iter().any(is_closed_loop);
    let blocks: Vec<(&Recording, Range<usize>)> = recordings
        .iter()
        .flat_map(|recording| {
            let steady = steady_range(recording, closed_loop, period, settings.settling_s);
            // A block begins where a period does, so that the excitation is the same in each.
            (steady.start.div_ceil(period)..)
                .map(move |index| index * period..index * period + length)
                .take_while(move |block| block.end <= steady.end)
                .map(move |block| (recording, block))
        })
        .collect();
    if blocks.len() < 2 {
        return Err(SavedError::TooShort {
            blocks: blocks.len(),
            period_s: settings.period_s,
        });
    }
    let lines = excited_lines(&blocks, length, sample_time_s, settings.band_hz);
    if lines.is_empty() {
        return Err(SavedError::NoExcitation {
            low_hz: settings.band_hz.0,
            high_hz: settings.band_hz.1,
        });
    }
    let suited = if closed_loop {
        Estimator::Instrument
    } else {
        Estimator::H1
    };
    let [estimate, plain] = estimates(&blocks, &lines, [suited, Estimator::H1]);
    Ok(FrfMeasurement {
        estimate,
        plain,
        closed_loop,
        recordings,
    })
}

/// The common sample time.
fn check(recordings: &[Recording], settings: &SavedSettings) -> Result<f64, SavedError> {
    let sample_time_s = recordings.first().map_or(f64::NAN, |r| r.sample_time_s);
    for (index, recording) in recordings.iter().enumerate() {
        if (recording.sample_time_s / sample_time_s - 1.0).abs() > MAX_STEP_DEVIATION {
            return Err(SavedError::SampleTime {
                index: index + 1,
                found_s: recording.sample_time_s,
                expected_s: sample_time_s,
            });
        }
    }
    let (low, high) = settings.band_hz;
    let checks = [
        (
            "period",
            settings.period_s,
            settings.period_s >= LEAST_PERIOD as f64 * sample_time_s && settings.period_s <= 100.0,
            "it must be 16 samples to 100 s",
        ),
        (
            "band",
            low,
            low >= 0.0,
            "the lowest frequency must be zero or more, in Hz",
        ),
        (
            "band",
            high,
            high > low,
            "the highest frequency must be above the lowest",
        ),
        (
            "settling time",
            settings.settling_s,
            (0.0..=1e3).contains(&settings.settling_s),
            "it must be 0 to 1000 s",
        ),
    ];
    for (field, value, holds, expected) in checks {
        if !holds {
            return Err(SettingError {
                field,
                value,
                expected,
            }
            .into());
        }
    }
    Ok(sample_time_s)
}

/// True if the voltage is more than the injection.
fn is_closed_loop(recording: &Recording) -> bool {
    let square: f64 = recording
        .voltage_v
        .iter()
        .zip(&recording.injection_v)
        .map(|(voltage, injection)| (voltage - injection).powi(2))
        .sum();
    (square / recording.len() as f64).sqrt() > FEEDBACK_V
}

/// The longest stretch at the reference's largest velocity, without the settling time; all but the first period when
/// there is no motion.
fn steady_range(
    recording: &Recording,
    closed_loop: bool,
    period: usize,
    settling_s: f64,
) -> Range<usize> {
    let at_rest = period..recording.len().max(period);
    let span = ((VELOCITY_S / recording.sample_time_s) as usize).max(1);
    let reference = &recording.reference_mm;
    if !closed_loop || reference.len() <= span {
        return at_rest;
    }
    let velocities: Vec<f64> = reference
        .windows(span + 1)
        .map(|window| (window[span] - window[0]) / (span as f64 * recording.sample_time_s))
        .collect();
    let fastest = velocities.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    if fastest < STANDSTILL_MM_S {
        return at_rest;
    }
    let (mut best, mut start) = (0..0, 0);
    for (index, velocity) in velocities.iter().enumerate() {
        if (velocity.abs() - fastest).abs() > MAX_VELOCITY_DEVIATION * fastest {
            start = index + 1;
        } else if index + 1 - start > best.len() {
            best = start..index + 1;
        }
    }
    let settling = (settling_s / recording.sample_time_s) as usize;
    (best.start + settling).min(best.end)..best.end
}

/// Number of blocks that are transformed at a time.
const BLOCKS_AT_A_TIME: usize = 32;

/// The lines of a block in the band at which the injection has power, away from what its window spreads.
fn excited_lines(
    blocks: &[(&Recording, Range<usize>)],
    length: usize,
    sample_time_s: f64,
    (low_hz, high_hz): (f64, f64),
) -> Vec<usize> {
    let transform = Transform::new(length);
    let mut power = vec![0.0; length / 2];
    // A few at a time, as an hour's recording has thousands of blocks; summed up in their order, so that the number of threads does not matter.
    for some in blocks.chunks(BLOCKS_AT_A_TIME) {
        let powers: Vec<Vec<f64>> = some
            .par_iter()
            .map_init(
                || transform.workspace(),
                |workspace, (recording, range)| {
                    workspace
                        .block
                        .copy_from_slice(&recording.injection_v[range.clone()]);
                    transform.run(workspace);
                    workspace.spectrum.iter().map(Complex64::norm_sqr).collect()
                },
            )
            .collect();
        for block in powers {
            for (power, value) in power.iter_mut().zip(&block) {
                *power += value;
            }
        }
    }
    let resolution_hz = 1.0 / (length as f64 * sample_time_s);
    // The lines of a periodic excitation are those of the period; a random one has power between them too.
    let lines = (BLOCK_PERIODS..length / 2)
        .step_by(BLOCK_PERIODS)
        .filter(|&line| (low_hz..=high_hz).contains(&(line as f64 * resolution_hz)));
    let most = lines
        .clone()
        .fold(0.0_f64, |most, line| most.max(power[line]));
    let excited: Vec<usize> = lines
        .filter(|&line| most > 0.0 && power[line] > MIN_LINE_POWER * most)
        .collect();
    let sum = |offset: usize| -> f64 { excited.iter().map(|line| power[line - offset]).sum() };
    if sum(1) < MAX_APERIODIC_POWER * sum(0) || excited.len() < 3 {
        return excited;
    }
    // At the edges of its band a random excitation leaks from one side only.
    excited[1..excited.len() - 1].to_vec()
}
