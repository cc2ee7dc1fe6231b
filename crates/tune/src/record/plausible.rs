//! Can the axis have made these numbers, in the unit their column names?

use super::columns::{Column, Columns};
use super::error::{RecordError, RecordWarning, UnitFault};
use super::limits::AxisLimits;
use std::path::Path;

/// Fewest encoder counts that are a motion.
const MIN_COUNTS: f64 = 10.0;
/// Time over which speed and acceleration are taken, s: from sample to sample, the steps of a quantised
/// reference would look like both.
const WINDOW_S: f64 = 0.005;
/// Ratio of measured travel to travel asked for beyond which no controller is that bad: half way, in decades, to the factor
/// of a thousand that is looked for.
const MAX_DISAGREEMENT: f64 = 30.0;
/// Lead of the position, in samples, that is worth a word.
const MIN_LEAD_SAMPLES: f64 = 2.0;

pub(super) fn check(
    path: &Path,
    columns: &Columns,
    sample_time_s: f64,
    limits: &AxisLimits,
) -> Result<(), RecordError> {
    let refuse = |column: &Column, fault| {
        Err(RecordError::Unit {
            path: path.to_owned(),
            column: column.name.to_owned(),
            fault,
        })
    };
    let Some(reference) = &columns.reference else {
        return Ok(());
    };
    let motion = Motion::of(reference, sample_time_s, limits);
    if let Some(fault) = motion.excess(limits, reference.mm_per_unit > 1.0) {
        return refuse(reference, fault);
    }
    if reference.mm_per_unit == 1.0
        && motion.travel_mm > 0.0
        && motion.travel_mm * 1e3 < limits.travel_mm
        && !columns
            .position
            .as_ref()
            .is_some_and(|position| steps_by_counts(position, limits.resolution_mm))
    {
        let fault = UnitFault::LooksLikeMetres {
            travel_mm: motion.travel_mm,
            limit_mm: limits.travel_mm,
        };
        return refuse(reference, fault);
    }
    let counts = motion.travel_mm / limits.resolution_mm;
    if counts < MIN_COUNTS {
        return refuse(
            reference,
            UnitFault::Still {
                travel_mm: motion.travel_mm,
                counts,
            },
        );
    }
    match &columns.position {
        Some(position) => agreement(path, position, motion.travel_mm),
        None => Ok(()),
    }
}

/// True if a position changes by counts of the axis' encoder, and never by less: then its unit is right, however small the motion.
fn steps_by_counts(position: &Column, resolution_mm: f64) -> bool {
    let changes = position
        .values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs());
    let least = changes
        .filter(|change| *change > 0.0)
        .fold(f64::INFINITY, f64::min);
    least.is_finite() && position.mm_per_unit * least > LEAST_STEP_COUNTS * resolution_mm
}

/// Smallest change of a position that was read from an encoder, counts: one, but for rounding.
const LEAST_STEP_COUNTS: f64 = 0.5;

/// True if a measured position moves like a reference that moves by `reference_mm`, within what a controller can be to blame
/// for.
fn agreement(path: &Path, position: &Column, reference_mm: f64) -> Result<(), RecordError> {
    let travel_mm = travel_mm(position);
    let ratio = travel_mm / reference_mm;
    if (1.0 / MAX_DISAGREEMENT..=MAX_DISAGREEMENT).contains(&ratio) {
        return Ok(());
    }
    Err(RecordError::Unit {
        path: path.to_owned(),
        column: position.name.to_owned(),
        fault: UnitFault::Disagrees {
            travel_mm,
            reference_mm,
        },
    })
}

/// Travel of a reference from which on an experiment is a motion that the axis follows, mm: a smaller one it may not have
/// followed, which friction experiments are about.
const FOLLOWED_MM: f64 = 1.0;

/// The same for an experiment, whose reference may stand still.
pub(super) fn check_experiment(path: &Path, columns: &Columns) -> Result<(), RecordError> {
    match (&columns.reference, &columns.position) {
        (Some(reference), Some(position)) if travel_mm(reference) > FOLLOWED_MM => {
            agreement(path, position, travel_mm(reference))
        }
        _ => Ok(()),
    }
}

/// Demands of a reference on an axis.
struct Motion {
    travel_mm: f64,
    velocity_mm_s: f64,
    acceleration_mm_s2: f64,
}

impl Motion {
    fn of(reference: &Column, sample_time_s: f64, limits: &AxisLimits) -> Self {
        let values = &reference.values;
        let span = ((WINDOW_S / sample_time_s).round() as usize).clamp(1, (values.len() - 1) / 2);
        let span_s = span as f64 * sample_time_s;
        let largest = |differences: &mut dyn Iterator<Item = f64>| {
            reference.mm_per_unit * differences.fold(0.0_f64, |largest, d| largest.max(d.abs()))
        };
        let first = largest(&mut values.iter().zip(&values[span..]).map(|(a, b)| b - a));
        let middle = values[span..].iter();
        let second = largest(
            &mut values
                .iter()
                .zip(middle)
                .zip(&values[2 * span..])
                .map(|((a, b), c)| a - 2.0 * b + c),
        );
        Self {
            travel_mm: travel_mm(reference),
            velocity_mm_s: first / span_s,
            // Rounding to counts alone makes second differences of up to two counts.
            acceleration_mm_s2: (second - 2.0 * limits.resolution_mm).max(0.0) / (span_s * span_s),
        }
    }

    fn excess(&self, limits: &AxisLimits, in_metres: bool) -> Option<UnitFault> {
        let demands = [
            ("travel", self.travel_mm, limits.travel_mm, "mm"),
            (
                "speed",
                self.velocity_mm_s,
                limits.max_velocity_mm_s,
                "mm/s",
            ),
            (
                "acceleration",
                self.acceleration_mm_s2,
                limits.max_acceleration_mm_s2,
                "mm/s²",
            ),
        ];
        let looks_like_mm = in_metres
            && demands
                .iter()
                .all(|(_, value, limit, _)| value * 1e-3 <= *limit);
        let (what, value, limit, unit) = demands
            .into_iter()
            .find(|(_, value, limit, _)| value > limit)?;
        Some(UnitFault::Exceeds {
            what,
            value,
            limit,
            unit,
            looks_like_mm,
        })
    }
}

/// The distance between the ends of a column's values, mm.
pub(super) fn travel_mm(column: &Column) -> f64 {
    range(&column.values) * column.mm_per_unit
}

/// The distance between the least and the largest of some values; zero of none.
pub(super) fn range(values: &[f64]) -> f64 {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.iter().fold(ends, |(low, high), value| {
        (low.min(*value), high.max(*value))
    });
    (high - low).max(0.0)
}

/// Swapped columns cannot be proved: with preview an axis can lead its reference. But as a rule it lags.
pub(super) fn doubts(
    reference_mm: &[f64],
    position_mm: Option<&[f64]>,
    sample_time_s: f64,
) -> Vec<RecordWarning> {
    let lead = position_mm.and_then(|position| lead_s(reference_mm, position, sample_time_s));
    lead.filter(|lead| *lead > MIN_LEAD_SAMPLES * sample_time_s)
        .map(|lead_s| RecordWarning::PositionLeads { lead_s })
        .into_iter()
        .collect()
}

/// The lead that explains most of the error, by least squares: error = -lead * velocity, where that explains more
/// than half of the error at all.
fn lead_s(reference: &[f64], position: &[f64], sample_time_s: f64) -> Option<f64> {
    let (mut vv, mut ve, mut ee) = (0.0, 0.0, 0.0);
    for (r, p) in reference.windows(3).zip(&position[1..]) {
        let velocity = (r[2] - r[0]) / (2.0 * sample_time_s);
        let error = r[1] - p;
        vv += velocity * velocity;
        ve += velocity * error;
        ee += error * error;
    }
    (ve * ve > 0.5 * vv * ee).then(|| -ve / vv)
}
