//! Samples of a curve: choosing and checking them.

use super::ReportError;

/// The samples at `kept`.
pub(super) fn pick(values: &[f64], kept: &[usize]) -> Vec<f64> {
    kept.iter().map(|&index| values[index]).collect()
}

/// Refuses a series whose two coordinates differ in length.
pub(super) fn same_length(
    figure: &str,
    series: &str,
    x: usize,
    y: usize,
) -> Result<(), ReportError> {
    if x == y {
        return Ok(());
    }
    Err(ReportError::SeriesLength {
        figure: figure.to_owned(),
        series: series.to_owned(),
        x,
        y,
    })
}
