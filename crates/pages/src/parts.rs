//! Parts that several pages have.

use quadrant_report::{Cell, Column, Figure, Lines, Plot, Provenance, Series, Style};

use crate::experiment::statistic::Statistic;

pub const UM_PER_MM: f64 = 1e3;

/// Returns the provenance of a page: the command line as a reader would repeat it, the seed, this program's version.
pub fn provenance(command: &str, seed: u64) -> Provenance {
    Provenance {
        command: command.to_owned(),
        seed: Some(seed),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// Mean and deviation as cells, in the unit that `scale` makes; missing where there is none.
pub fn statistic_cells(statistic: Option<Statistic>, scale: f64, decimals: usize) -> [Cell; 2] {
    let cell = |value: Option<f64>| {
        value.map_or(Cell::Missing, |value| Cell::number(scale * value, decimals))
    };
    [
        cell(statistic.map(|found| found.mean)),
        cell(statistic.and_then(|found| found.deviation)),
    ]
}

/// An error in mm over time, as a curve in um; samples are `period_s` apart.
pub fn error_curve(name: String, error_mm: &[f64], period_s: f64, style: Style) -> Series {
    Series {
        name,
        x: (0..error_mm.len()).map(|k| k as f64 * period_s).collect(),
        y: error_mm.iter().map(|error| error * UM_PER_MM).collect(),
        style,
    }
}

/// Heads of columns, each with its unit or an empty one.
pub fn columns(heads: &[(&str, &str)]) -> Vec<Column> {
    heads
        .iter()
        .map(|(heading, unit)| match *unit {
            "" => Column::new(*heading),
            unit => Column::with_unit(*heading, unit),
        })
        .collect()
}

/// A figure of curves over a common axis.
pub fn lines(id: &str, caption: &str, labels: (&str, &str), series: Vec<Series>) -> Figure {
    Figure {
        id: id.to_owned(),
        caption: caption.to_owned(),
        plot: Plot::Lines(Lines {
            x_label: labels.0.to_owned(),
            y_label: labels.1.to_owned(),
            series,
            ..Lines::default()
        }),
    }
}

pub fn series(name: &str, x: Vec<f64>, y: Vec<f64>, style: Style) -> Series {
    Series {
        name: name.to_owned(),
        x,
        y,
        style,
    }
}
