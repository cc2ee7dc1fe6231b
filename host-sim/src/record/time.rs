//! Is the time column a clock's?

use super::columns::Column;
use super::error::{RecordError, TimeFault};
use std::path::Path;

/// Largest deviation of a step from the median step, as its share.
const TOLERANCE: f64 = 0.01;
/// Rates at which machines are controlled and recorded, Hz.
const RATES_HZ: (f64, f64) = (100.0, 100_000.0);

/// The sample time, s.
pub(super) fn check(path: &Path, time: &Column) -> Result<f64, RecordError> {
    let fault = |index: usize, fault| RecordError::Time {
        path: path.to_owned(),
        line: time.line(index),
        value: time.values[index],
        fault,
    };
    let steps: Vec<f64> = time
        .values
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .collect();
    if let Some(i) = steps.iter().position(|step| *step <= 0.0) {
        let kind = if steps[i] == 0.0 {
            TimeFault::Repeated
        } else {
            TimeFault::Backwards {
                previous: time.values[i],
            }
        };
        return Err(fault(i + 1, kind));
    }
    // The median is the sample time even where some rows are missing.
    let median = median(steps.clone());
    let plausible = |step: f64| (RATES_HZ.0..=RATES_HZ.1).contains(&(1.0 / step).round());
    if !plausible(median) {
        return Err(RecordError::SampleRate {
            path: path.to_owned(),
            sample_time_s: median,
            rate_hz: 1.0 / median,
            hint: if plausible(median * 1e-3) {
                "; this looks like milliseconds in a column named t_s"
            } else {
                ""
            },
        });
    }
    if let Some(i) = steps
        .iter()
        .position(|step| (step - median).abs() > TOLERANCE * median)
    {
        return Err(fault(
            i + 1,
            TimeFault::Step {
                step: steps[i],
                median,
            },
        ));
    }
    // Over the whole record the digits that each row was rounded to do not matter.
    let (first, last) = (time.values[0], time.values[steps.len()]);
    Ok((last - first) / steps.len() as f64)
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
