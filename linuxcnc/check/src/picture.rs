//! The error of an axis around a slow reversal, under several loops.

use anyhow::{Context, Result};
use quadrant_linuxcnc::plant::Recorded;
use quadrant_report::{Figure, Lines, Plot, Series, Style};

/// Time that is shown, before and after the reversal, s.
const SHOWN_S: (f64, f64) = (0.1, 0.4);

/// The error of x, um, over time, s, around its last reversal from larger to smaller positions.
pub(crate) fn curve(
    name: &str,
    record: &[Recorded],
    rate_hz: f64,
    number: usize,
) -> Result<Series> {
    let moved = |pair: &[Recorded]| pair[1][0][0] - pair[0][0][0];
    let pairs: Vec<f64> = record.windows(2).map(moved).collect();
    let last = pairs.iter().rposition(|moved| *moved > 1e-9);
    let reversal = last.context("a reversal")?;
    let ticks = |seconds: f64| (seconds * rate_hz) as usize;
    let begin = reversal.saturating_sub(ticks(SHOWN_S.0));
    let end = record.len().min(reversal + ticks(SHOWN_S.1));
    let errors = record[begin..end]
        .iter()
        .map(|[command, position]| (1e4 * (command[0] - position[0])).round() / 10.0);
    Ok(Series {
        name: name.to_owned(),
        x: (begin..end)
            .map(|tick| (tick as f64 - reversal as f64) / rate_hz)
            .collect(),
        y: errors.collect(),
        style: Style::nth(number),
    })
}

/// The image.
pub(crate) fn svg(series: Vec<Series>, rate_hz: f64) -> Result<String> {
    let figure = Figure {
        id: "linuxcnc-reversal".to_owned(),
        caption: format!("Simulated. Error of x at a reversal from 2 mm/s, {rate_hz} Hz"),
        plot: Plot::Lines(Lines {
            x_label: "time (s)".to_owned(),
            y_label: "error (um)".to_owned(),
            series,
            ..Lines::default()
        }),
    };
    Ok(figure.to_svg()?)
}
