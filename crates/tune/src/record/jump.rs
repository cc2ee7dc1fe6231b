//! Positions that jump: counts that an encoder lost, and single rows that are wrong.

use std::path::Path;

use super::columns::Column;
use super::error::RecordError;
use super::lines::Lines;

/// Steps either side of one that say how far it should go.
const NEIGHBOURS: usize = 3;
/// Share of the steps that are taken for ordinary.
const ORDINARY: f64 = 0.99;
/// A jump over what ordinary steps differ from their neighbours.
const JUMP_RATIO: f64 = 20.0;
/// A jump over the smallest change of the position.
const JUMP_COUNTS: f64 = 30.0;
/// Time at each end of the record that is not looked at, s: a motion may begin there at once, and identification cuts it.
const EDGE_S: f64 = 0.05;

/// Refuses a position that goes further in one row than the rows before and after it allow. A change of velocity stays, and a
/// jump does not: so a step is compared with the medians of its neighbours on both sides, and counts as far as it is beyond both.
/// The step from one part of a recording to the next is free: the axis may have moved in between.
///
/// # Errors
/// The first jump, with its line.
pub(super) fn refuse(
    path: &Path,
    time_s: &[f64],
    position: &Column,
    part: Option<&Column>,
    lines: &Lines,
) -> Result<(), RecordError> {
    let values = &position.values;
    let velocity: Vec<f64> = values
        .windows(2)
        .zip(time_s.windows(2))
        .map(|(x, t)| (x[1] - x[0]) / (t[1] - t[0]))
        .collect();
    let beyond: Vec<f64> = (0..velocity.len())
        .map(|step| (time_s[step + 1] - time_s[step]) * excess(&velocity, step))
        .collect();
    let mut sorted = beyond.clone();
    let place = (ORDINARY * sorted.len() as f64) as usize;
    let place = place.min(sorted.len() - 1);
    let ordinary = *sorted.select_nth_unstable_by(place, f64::total_cmp).1;
    let count = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|change| *change > 0.0)
        .fold(f64::INFINITY, f64::min);
    let most = (JUMP_RATIO * ordinary).max(JUMP_COUNTS * count);
    let inner = time_s[0] + EDGE_S..time_s[time_s.len() - 1] - EDGE_S;
    let joined = |step: usize| part.is_some_and(|part| part.values[step] != part.values[step + 1]);
    let jumps =
        |step: &usize| beyond[*step] > most && inner.contains(&time_s[*step]) && !joined(*step);
    let mut jumps = (0..beyond.len()).filter(jumps);
    let Some(first) = jumps.next() else {
        return Ok(());
    };
    Err(RecordError::Jump {
        path: path.to_owned(),
        line: lines.line(first + 1),
        from_mm: values[first] * position.mm_per_unit,
        to_mm: values[first + 1] * position.mm_per_unit,
        others: jumps.count(),
    })
}

/// The amount by which a step's velocity is beyond those of its neighbours on both sides.
fn excess(velocity: &[f64], step: usize) -> f64 {
    let before = median(&velocity[step.saturating_sub(NEIGHBOURS)..step]);
    let end = velocity.len().min(step + 1 + NEIGHBOURS);
    let after = median(&velocity[step + 1..end]);
    let (before, after) = match (before, after) {
        (Some(before), Some(after)) => (before, after),
        // At an end of the record a change may have gone on.
        _ => return 0.0,
    };
    let (low, high) = (before.min(after), before.max(after));
    (low - velocity[step]).max(velocity[step] - high).max(0.0)
}

fn median(values: &[f64]) -> Option<f64> {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
