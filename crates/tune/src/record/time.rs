//! Is the time column a clock's?

use super::columns::Column;
use super::error::{RecordError, TimeFault};
use super::lines::Lines;
use rayon::prelude::*;
use std::path::Path;

/// Largest deviation of a step from the median step, as its share.
const TOLERANCE: f64 = 0.01;
/// Rates at which machines are controlled and recorded, Hz.
const RATES_HZ: (f64, f64) = (100.0, 100_000.0);

/// The sample time, s.
pub(super) fn check(path: &Path, time: &Column, lines: &Lines) -> Result<f64, RecordError> {
    let values = &time.values;
    if !is_even(values) {
        check_steps(path, values, lines)?;
    }
    // Over the whole record the digits that each row was rounded to do not matter.
    let last = values.len() - 1;
    Ok((values[last] - values[0]) / last as f64)
}

/// Longest step that is interpolated, over the median step.
const LONGEST_STEP: f64 = 5.0;

/// An even time, and the steps of the uneven one that it stands for.
pub(super) struct Grid {
    pub(super) sample_time_s: f64,
    /// Shortest and longest step of the record, s.
    pub(super) steps_s: (f64, f64),
}

impl Grid {
    /// As many samples as the record has, from its first time to its last.
    ///
    /// # Errors
    /// Time that does not increase, or pauses for longer than may be interpolated.
    pub(super) fn of(path: &Path, time: &Column, lines: &Lines) -> Result<Self, RecordError> {
        let values = &time.values;
        let steps = steps(path, values, lines)?;
        let median = median(steps.clone());
        check_rate(path, median, 1)?;
        let most = LONGEST_STEP * median;
        if let Some(index) = steps.iter().position(|step| *step > most) {
            return Err(RecordError::Time {
                path: path.to_owned(),
                line: lines.line(index + 1),
                value: values[index + 1],
                fault: TimeFault::Pause {
                    step: steps[index],
                    most,
                },
            });
        }
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let last = values.len() - 1;
        Ok(Self {
            sample_time_s: (values[last] - values[0]) / last as f64,
            steps_s: steps
                .iter()
                .fold(ends, |(low, high), step| (low.min(*step), high.max(*step))),
        })
    }

    /// A signal at the even times, on the straight line between the rows about each.
    pub(super) fn resampled(&self, time_s: &[f64], signal: &[f64]) -> Vec<f64> {
        let mut row = 0;
        (0..signal.len())
            .map(|sample| {
                let at = time_s[0] + sample as f64 * self.sample_time_s;
                while row + 2 < signal.len() && time_s[row + 1] <= at {
                    row += 1;
                }
                let share = (at - time_s[row]) / (time_s[row + 1] - time_s[row]);
                signal[row] + share.clamp(0.0, 1.0) * (signal[row + 1] - signal[row])
            })
            .collect()
    }
}

/// True if the shortest and the longest step alone show that no step can be refused, wherever the median lies between them.
fn is_even(values: &[f64]) -> bool {
    let (shortest, longest) = values
        .par_windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(
            || (f64::INFINITY, f64::NEG_INFINITY),
            |(shortest, longest), step| (shortest.min(step), longest.max(step)),
        )
        .reduce(
            || (f64::INFINITY, f64::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
    shortest > 0.0
        && is_plausible(shortest)
        && is_plausible(longest)
        && longest - shortest <= TOLERANCE * shortest
}

/// True if a machine may be sampled in this time, s.
fn is_plausible(step: f64) -> bool {
    (RATES_HZ.0..=RATES_HZ.1).contains(&(1.0 / step).round())
}

/// Refuses a sample time, s, of which no machine is controlled in the `decimation`th part at most.
pub(super) fn check_rate(
    path: &Path,
    sample_time_s: f64,
    decimation: usize,
) -> Result<(), RecordError> {
    let least_hz = RATES_HZ.0 / decimation.max(1) as f64;
    if (least_hz..=RATES_HZ.1).contains(&(1.0 / sample_time_s).round()) {
        return Ok(());
    }
    Err(RecordError::SampleRate {
        path: path.to_owned(),
        sample_time_s,
        rate_hz: 1.0 / sample_time_s,
        least_hz,
        hint: if is_plausible(sample_time_s * 1e-3) {
            "; this looks like milliseconds in a column named t_s"
        } else {
            ""
        },
    })
}

/// The steps of a time that increases.
fn steps(path: &Path, values: &[f64], lines: &Lines) -> Result<Vec<f64>, RecordError> {
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(index) = steps.iter().position(|step| *step <= 0.0) else {
        return Ok(steps);
    };
    Err(RecordError::Time {
        path: path.to_owned(),
        line: lines.line(index + 1),
        value: values[index + 1],
        fault: match steps[index] {
            0.0 => TimeFault::Repeated,
            _ => TimeFault::Backwards {
                previous: values[index],
            },
        },
    })
}

/// Looks for the first step that is refused.
fn check_steps(path: &Path, values: &[f64], lines: &Lines) -> Result<(), RecordError> {
    let fault = |index: usize, fault| RecordError::Time {
        path: path.to_owned(),
        line: lines.line(index),
        value: values[index],
        fault,
    };
    let steps = steps(path, values, lines)?;
    // The median is the sample time even where some rows are missing.
    let median = median(steps.clone());
    check_rate(path, median, 1)?;
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
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn steps_that_are_even_at_a_glance_are_even_when_looked_at(
            step_s in prop_oneof![Just(1e-5), Just(1e-2), 9e-6..2e-2_f64],
            jitter in prop::collection::vec(-0.6..0.6_f64, 20..60),
            share in prop_oneof![Just(0.0), Just(0.01), 0.0..0.02_f64],
        ) {
            let mut time_s = 0.0;
            let mut next = |jitter: &f64| {
                time_s += step_s * (1.0 + share * jitter);
                time_s
            };
            let values: Vec<f64> = jitter.iter().map(&mut next).collect();
            let looked_at = check_steps(Path::new(""), &values, &Lines::default());
            prop_assert!(!is_even(&values) || looked_at.is_ok());
        }
    }

    #[test]
    fn a_glance_is_enough_for_a_clock_of_few_digits() {
        let values: Vec<f64> = (0..1000).map(|row| f64::from(row) * 1e-4).collect();
        assert!(is_even(&values));
        let rounded: Vec<f64> = values
            .iter()
            .map(|time| (time * 1e6).round() / 1e6)
            .collect();
        assert!(is_even(&rounded));
    }
}
