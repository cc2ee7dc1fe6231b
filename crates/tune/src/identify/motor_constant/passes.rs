//! The passes of a test, in which the axis slides one way, and what each says.

use nalgebra::{DMatrix, DVector};

use super::MotorConstantError;
use super::settings::{DRIVING_V, Levels, MotorConstantSettings, dwell};
use crate::record::Recording;

/// Levels at the beginning of a pass that do not count: the axis breaks away.
const BREAKAWAY_LEVELS: usize = 6;
/// Least way of the slowest sliding in the usual dwell that suffices, counts.
const SLIDING_COUNTS: f64 = 600.0;
/// Least way in any case, counts.
const LEAST_COUNTS: f64 = 60.0;
/// Way that suffices with fewer counts than [`SLIDING_COUNTS`], mm.
const SLIDING_MM: f64 = 0.3;
/// Least speed over the mean in a gentle test, from level to level.
const MIN_SPEED_RATIO: f64 = 0.4;
/// Step between the dead times that are tried, s.
const DELAY_STEP_S: f64 = 1e-4;
/// Longest dead time that is tried, s.
const LONGEST_DELAY_S: f64 = 6e-3;
/// Longest dead time that is tried, over the dwell.
const MAX_DELAY_RATIO: f64 = 0.8;

/// A, B and friction of one pass.
#[derive(Clone, Copy)]
pub(super) struct Pass {
    /// Direction, 1 or -1.
    pub(super) sign: f64,
    pub(super) gain: f64,
    pub(super) damping_per_s: f64,
    pub(super) friction_v: f64,
}

/// The passes in which the axis slid, with where each begins, counts from, and ends.
pub(super) fn find_passes(
    recording: &Recording,
    settings: &MotorConstantSettings,
    resolution_mm: f64,
) -> Result<Vec<(Pass, [usize; 3])>, MotorConstantError> {
    let dwell = dwell(settings, 1.0 / recording.sample_time_s);
    // The way goes with the square of the time.
    let short = (settings.dwell_s / MotorConstantSettings::default().dwell_s).powi(2);
    let sliding_mm = (SLIDING_COUNTS * resolution_mm)
        .min((LEAST_COUNTS * resolution_mm).max(SLIDING_MM * short));
    let mut found = Vec::new();
    let mut begin = 0;
    while begin < recording.len() {
        let sign = recording.voltage_v[begin].signum();
        let drives = |index: &usize| sign * recording.voltage_v[*index] > DRIVING_V;
        if !drives(&begin) {
            begin += 1;
            continue;
        }
        let end = (begin..recording.len())
            .find(|index| !drives(index))
            .unwrap_or(recording.len());
        let pass_v: Vec<f64> = recording.voltage_v[begin..end]
            .iter()
            .map(|volts| volts.abs())
            .collect();
        let from = begin + Levels::of(&pass_v).first + BREAKAWAY_LEVELS * dwell;
        if end >= from + 4 * dwell {
            let positions = &recording.position_mm[from..end];
            let slowest = |window: usize| {
                positions
                    .windows(window)
                    .map(|window| sign * (window[window.len() - 1] - window[0]))
                    .fold(f64::INFINITY, f64::min)
            };
            let slides = if settings.is_gentle() {
                // From one upper level to the next: a motor on a soft spring swings back between them, though the table slides on.
                let way = sign * (positions[positions.len() - 1] - positions[0]);
                let mean = way * (2 * dwell) as f64 / positions.len() as f64;
                slowest(2 * dwell) > (LEAST_COUNTS * resolution_mm).max(MIN_SPEED_RATIO * mean)
            } else {
                slowest(dwell) > sliding_mm
            };
            // From before the pass on: in it, an axis on a soft spring may swing back.
            let all = sign * (recording.position_mm[end - 1] - recording.position_mm[begin]);
            if -all > 4.0 * sliding_mm {
                return Err(MotorConstantError::Reversed);
            }
            if slides {
                let pass = fit_pass(recording, begin, from, end, dwell);
                found.push((pass, [begin, from, end]));
            }
        }
        begin = end;
    }
    Ok(found)
}

/// The parameters of one pass, with the dead time that fits best. `begin` is where its voltage begins, `lag` the time in samples over
/// which differences are taken.
pub(super) fn fit_pass(
    recording: &Recording,
    begin: usize,
    from: usize,
    end: usize,
    lag: usize,
) -> Pass {
    let step_s = recording.sample_time_s;
    let sign = recording.voltage_v[begin].signum();
    let positions = &recording.position_mm[from..end];
    // Second differences over a dwell keep what the steps do, and little of the screw's slow ripple and of the start.
    let second = |signal: &[f64]| -> Vec<f64> {
        signal
            .windows(2 * lag + 1)
            .map(|window| window[2 * lag] - 2.0 * window[lag] + window[0])
            .collect()
    };
    let right = second(positions);
    let path = second(&integral(positions, positions[0], step_s));
    let none = Pass {
        sign,
        gain: f64::NAN,
        damping_per_s: f64::NAN,
        friction_v: f64::NAN,
    };
    let mut best = (f64::INFINITY, none);
    // A delay of a whole level would swap the two.
    let longest_s = LONGEST_DELAY_S.min(MAX_DELAY_RATIO * lag as f64 * step_s);
    let longest = ((longest_s / step_s) as usize).min(from - begin);
    for delay in (0..=longest).step_by(((DELAY_STEP_S / step_s) as usize).max(1)) {
        let push = integral(&recording.voltage_v[from - delay..end - delay], 0.0, step_s);
        // The voltage is held: the mean of its integral over a step is that at the step's middle.
        let middle: Vec<f64> = push
            .windows(2)
            .map(|pair| 0.5 * (pair[0] + pair[1]))
            .collect();
        let double_push = second(&integral(&middle, 0.0, step_s));
        let count = right.len().min(double_push.len());
        let columns = [double_push, vec![1.0; count], path.clone()];
        if let Some(fit) = fit_columns(&columns, &right[..count], sign, lag as f64 * step_s)
            && fit.0 < best.0
        {
            best = fit;
        }
    }
    best.1
}

/// The pass whose columns, first those of push, friction and path, give `right` with the least squares over a lag, s; and what is
/// left, squared.
pub(super) fn fit_columns<const N: usize>(
    columns: &[Vec<f64>; N],
    right: &[f64],
    sign: f64,
    lag_s: f64,
) -> Option<(f64, Pass)> {
    let norms = columns.each_ref().map(|column| norm(column));
    let matrix = DMatrix::from_fn(right.len(), N, |row, column| {
        columns[column][row] / norms[column]
    });
    let right = DVector::from_column_slice(right);
    let solution = matrix.clone().svd(true, true).solve(&right, 1e-12).ok()?;
    let cost = (&matrix * &solution - right).norm_squared();
    let gain = solution[0] / norms[0];
    let slowing = -sign * solution[1] / norms[1] / lag_s.powi(2);
    let pass = Pass {
        sign,
        gain,
        damping_per_s: -solution[2] / norms[2],
        friction_v: slowing / gain,
    };
    Some((cost, pass))
}

/// The running integral of held samples over `base`, beginning at zero.
pub(super) fn integral(samples: &[f64], base: f64, step_s: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = vec![sum];
    sums.extend(samples.iter().map(|sample| {
        sum += (sample - base) * step_s;
        sum
    }));
    sums
}

/// Length of a column of a least-squares problem, above zero.
fn norm(column: &[f64]) -> f64 {
    let square: f64 = column.iter().map(|value| value * value).sum();
    square.sqrt().max(1e-12)
}
