//! The fit of every model, and its validation.

use rayon::prelude::*;

use super::error::{LEAST_PERCENT, LEAST_ROWS, MotionFitError};
use super::model::{MotionModel, Structure};
use super::regressors::Regression;
use super::signals::{MotionFitSettings, Signals};
use super::solution::{MOST_DEAD_TIME_S, Solution};
use super::uncertainty::estimates;
use crate::identify::setting::SettingError;
use crate::record::Recording;

/// A model, and how it does where it was not fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The model, fitted to the whole record.
    pub model: MotionModel,
    /// Relative error of models fitted to every other pair of motion segments on the pairs between, both ways round;
    /// nothing when there are too few segments.
    pub validation_error: Option<f64>,
    /// The rows of the regression.
    pub rows: Rows,
}

/// Voltage explained by a fit, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Velocity, mm/s.
    pub velocity_mm_s: Vec<f64>,
    /// Voltage that was commanded a dead time before, V.
    pub voltage_v: Vec<f64>,
    /// Residual of the model, V.
    pub residual_v: Vec<f64>,
    /// Voltage without inertia and offset, V: the friction.
    pub friction_v: Vec<f64>,
}

/// Share of the largest velocity below which the axis does not count as moving.
const MOVING: f64 = 0.01;
/// Fits every structure of [`Structure::ALL`] to a record; `progress` is told the share that is done.
///
/// # Errors
/// A record that is too short, moves one way only, or does not tell parameters apart.
pub fn fit_motion(
    recording: &Recording,
    settings: &MotionFitSettings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Candidate>, MotionFitError> {
    check(recording, settings)?;
    let signals = Signals::new(recording, settings);
    let velocity = signals.decimated(&signals.velocity_mm_s, settings);
    let segments = segments(&velocity)?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    Structure::ALL
        .into_par_iter()
        .map(|structure| {
            let candidate = candidate(&signals, settings, structure, &segments);
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            progress(count as f64 / Structure::ALL.len() as f64);
            candidate
        })
        .collect()
}

fn check(recording: &Recording, settings: &MotionFitSettings) -> Result<(), MotionFitError> {
    let refuse = |field, value, expected| {
        Err(SettingError {
            field,
            value,
            expected,
        }
        .into())
    };
    let half_rate_hz = 0.5 / recording.sample_time_s;
    if !(settings.cutoff_hz > 0.0 && settings.cutoff_hz < 0.9 * half_rate_hz) {
        let expected = "it must be above zero and below 0.45 of the record's sampling rate, in Hz";
        return refuse("cut-off", settings.cutoff_hz, expected);
    }
    if !(settings.edge_s >= 0.0 && settings.edge_s <= 100.0) {
        return refuse("cut edges", settings.edge_s, "they must be 0 to 100 s");
    }
    if !(settings.row_rate_hz >= 1.0 && settings.row_rate_hz <= 2.0 * half_rate_hz) {
        let expected = "it must be 1 Hz to the record's sampling rate";
        return refuse("row rate", settings.row_rate_hz, expected);
    }
    if let Some(dead_time_s) = settings.dead_time_s
        && !(0.0..=MOST_DEAD_TIME_S).contains(&dead_time_s)
    {
        return refuse("dead time", dead_time_s, "it must be 0 to 0.02 s");
    }
    let ascending = settings.knots_mm.windows(2).all(|pair| pair[0] < pair[1]);
    let within = settings
        .knots_mm
        .iter()
        .all(|knot| (1e-6..=10.0).contains(knot));
    if settings.knots_mm.is_empty() || settings.knots_mm.len() > 8 || !(ascending && within) {
        let expected = "there must be 1 to 8 knots, ascending, of 0.000001 to 10 mm";
        return refuse("knots", settings.knots_mm.len() as f64, expected);
    }
    let period_s = recording.sample_time_s;
    let left = recording
        .len()
        .saturating_sub(2 * settings.edge_samples(period_s));
    let rows = left / settings.decimation(period_s);
    if rows < LEAST_ROWS {
        return Err(MotionFitError::TooShort { rows });
    }
    Ok(())
}

/// The motion segment that each row belongs to: from reversal to reversal.
fn segments(velocity_mm_s: &[f64]) -> Result<Vec<usize>, MotionFitError> {
    let largest = velocity_mm_s
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    let moving = MOVING * largest;
    let share = |sign: f64| {
        let count = velocity_mm_s.iter().filter(|v| **v * sign > moving).count();
        100.0 * count as f64 / velocity_mm_s.len() as f64
    };
    let percent = share(1.0).min(share(-1.0));
    if percent < LEAST_PERCENT {
        return Err(MotionFitError::OneWay { percent });
    }
    let (mut segment, mut way) = (0, 0.0);
    Ok(velocity_mm_s
        .iter()
        .map(|velocity| {
            if velocity.abs() > moving {
                if way * velocity < 0.0 {
                    segment += 1;
                }
                way = velocity.signum();
            }
            segment
        })
        .collect())
}

fn candidate(
    signals: &Signals,
    settings: &MotionFitSettings,
    structure: Structure,
    segments: &[usize],
) -> Result<Candidate, MotionFitError> {
    let regression = Regression::new(signals, settings, structure);
    let all: Vec<usize> = (0..regression.rows()).collect();
    let whole = Solution::find(&regression, structure, &all)?;
    let residual = whole.residual(&regression, &all);
    let row_s = signals.sample_time_s * settings.decimation(signals.sample_time_s) as f64;
    let estimates = estimates(&whole, &regression, structure, settings, &residual);
    let model = whole.model(&regression, structure, settings, &residual, estimates)?;
    let acceleration = signals.decimated(&signals.acceleration_mm_s2, settings);
    let voltage = regression.voltage_at(whole.dead_time_s);
    let friction = voltage
        .iter()
        .zip(&acceleration)
        .map(|(volts, a)| volts - model.inertia_v_s2_per_mm * a - model.offset_v);
    Ok(Candidate {
        validation_error: validation(&regression, structure, segments)?,
        rows: Rows {
            time_s: all
                .iter()
                .map(|row| settings.edge_s + *row as f64 * row_s)
                .collect(),
            velocity_mm_s: regression.velocity_mm_s.clone(),
            friction_v: friction.collect(),
            voltage_v: voltage.iter().copied().collect(),
            residual_v: residual.iter().copied().collect(),
        },
        model,
    })
}

/// The model to use: that with the smallest error where it was not fitted (or, without validation, where it was), among
/// those whose level does not rise with the velocity.
pub fn recommended(candidates: &[Candidate]) -> Option<&Candidate> {
    let error = |candidate: &Candidate| {
        candidate
            .validation_error
            .unwrap_or(candidate.model.relative_error)
    };
    candidates
        .iter()
        .filter(|candidate| candidate.model.is_stribeck())
        .min_by(|a, b| error(a).total_cmp(&error(b)))
}

/// Fits one half of the pairs of segments and judges the other, both ways round.
fn validation(
    regression: &Regression<'_>,
    structure: Structure,
    segments: &[usize],
) -> Result<Option<f64>, MotionFitError> {
    // A pair holds both senses of motion, so that either half can be fitted by itself.
    let half = |parity: usize| -> Vec<usize> {
        (0..segments.len())
            .filter(|&row| segments[row] / 2 % 2 == parity)
            .collect()
    };
    if segments.last().is_none_or(|last| *last < 3) {
        return Ok(None);
    }
    let (mut missed, mut total) = (0.0, 0.0);
    for parity in [0, 1] {
        let found = match Solution::find(regression, structure, &half(parity)) {
            // Half of a record may tell too little.
            Err(MotionFitError::Dependent { .. }) => return Ok(None),
            found => found?,
        };
        let others = half(1 - parity);
        missed += found.residual(regression, &others).norm_squared();
        let voltage = regression.voltage_at(found.dead_time_s);
        total += voltage.select_rows(&others).norm_squared();
    }
    Ok(Some((missed / total).sqrt()))
}
