//! Figures: a caption and one of the kinds of drawing.

use serde::{Deserialize, Serialize};

use super::dots::Dots;
use super::drawing::Drawing;
use super::lines::Lines;
use super::polar::PolarDeviation;
use super::{Colour, ReportError};

/// A drawing with its caption.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Unique on its page; also the name of the image a reader saves.
    pub id: String,
    /// Caption: the subject of the figure.
    pub caption: String,
    /// The drawing.
    pub plot: Plot,
}

/// The kinds of drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Plot {
    /// Curves over a common axis, or paths in a plane.
    Lines(Lines),
    /// Radial deviation from a circle.
    PolarDeviation(PolarDeviation),
    /// Values by category, with their spread.
    Dots(Dots),
}

/// Style of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Style {
    /// Its colour.
    pub colour: Colour,
    /// Its dashes.
    pub dash: Dash,
}

/// The dashes of a line. Colour alone does not carry meaning in print.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dash {
    /// Unbroken.
    Solid,
    /// Dashed.
    Dashed,
    /// Dotted.
    Dotted,
    /// Marks that are not joined: measured points.
    Points,
}

impl Style {
    /// An unbroken line.
    #[must_use]
    pub const fn solid(colour: Colour) -> Self {
        Self {
            colour,
            dash: Dash::Solid,
        }
    }

    /// A dashed line.
    #[must_use]
    pub const fn dashed(colour: Colour) -> Self {
        Self {
            colour,
            dash: Dash::Dashed,
        }
    }

    /// Marks that are not joined: measured points.
    #[must_use]
    pub const fn points(colour: Colour) -> Self {
        Self {
            colour,
            dash: Dash::Points,
        }
    }

    /// The style of the `index`th of several equal curves: all colours unbroken first, then dashed, then dotted.
    #[must_use]
    pub fn nth(index: usize) -> Self {
        let colours = Colour::CYCLE.len();
        let dash = [Dash::Solid, Dash::Dashed, Dash::Dotted][index / colours % 3];
        Self {
            colour: Colour::CYCLE[index % colours],
            dash,
        }
    }
}

impl Figure {
    /// Number of entries in the legend.
    pub(super) fn curve_count(&self) -> usize {
        match &self.plot {
            Plot::Lines(lines) => lines.bands.len() + lines.series.len(),
            Plot::PolarDeviation(circle) => circle.traces.len(),
            Plot::Dots(dots) => dots.series.len(),
        }
    }

    /// Returns the note that follows the caption because the drawing cannot be read without it.
    pub(super) fn note(&self) -> Option<String> {
        match &self.plot {
            Plot::Lines(_) => None,
            Plot::PolarDeviation(circle) => Some(circle.scale_note()),
            Plot::Dots(_) => None,
        }
    }

    pub(super) fn check(&self) -> Result<(), ReportError> {
        match &self.plot {
            Plot::Lines(lines) => lines.check(&self.id),
            Plot::PolarDeviation(circle) => circle.check(&self.id),
            Plot::Dots(dots) => dots.check(&self.id),
        }
    }

    /// The same with at most `points` samples of each curve; no spike is lost.
    pub(super) fn decimated(&self, points: usize) -> Self {
        let plot = match &self.plot {
            Plot::Lines(lines) => Plot::Lines(lines.decimated(points)),
            Plot::PolarDeviation(circle) => Plot::PolarDeviation(circle.decimated(points)),
            Plot::Dots(dots) => Plot::Dots(dots.clone()),
        };
        Self {
            id: self.id.clone(),
            caption: self.caption.clone(),
            plot,
        }
    }

    /// The figure as it is drawn, with every sample.
    pub(super) fn drawing(&self) -> Drawing {
        let mut drawing = match &self.plot {
            Plot::Lines(lines) => lines.drawing(),
            Plot::PolarDeviation(circle) => circle.drawing(),
            Plot::Dots(dots) => dots.drawing(),
        };
        drawing.caption.clone_from(&self.caption);
        drawing
    }
}

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

#[cfg(test)]
mod tests {
    use super::{Dash, Figure, Plot, Style};
    use crate::{Colour, Lines, ReportError, Series};

    fn figure(x: Vec<f64>, y: Vec<f64>) -> Figure {
        let series = vec![Series {
            name: "PID".into(),
            x,
            y,
            style: Style::nth(0),
        }];
        let plot = Plot::Lines(Lines {
            x_label: "Time (s)".into(),
            y_label: "Error (µm)".into(),
            series,
            ..Lines::default()
        });
        Figure {
            id: "error".into(),
            caption: String::new(),
            plot,
        }
    }

    #[test]
    fn series_of_unequal_length_are_named() {
        let error = figure(vec![1.0, 2.0], vec![1.0]).check().unwrap_err();
        assert!(
            matches!(&error, ReportError::SeriesLength { series, x: 2, y: 1, .. } if series == "PID")
        );
    }

    #[test]
    fn numbers_are_short_and_gaps_are_null() {
        let figure = figure(
            vec![0.0, 0.1 + 0.2, 1.0],
            vec![0.123_456_789, f64::NAN, 1.0],
        );
        let json = serde_json::to_string(&figure.drawing()).unwrap();
        assert!(json.contains("\"x\":[0.0,0.3,1.0]"), "{json}");
        assert!(json.contains("\"y\":[0.123457,null,1.0]"), "{json}");
    }

    #[test]
    fn styles_do_not_repeat_before_eighteen_curves() {
        let styles: Vec<Style> = (0..18).map(Style::nth).collect();
        for (i, style) in styles.iter().enumerate() {
            assert!(!styles[..i].contains(style), "{i}");
        }
        assert_eq!(
            styles[0],
            Style {
                colour: Colour::Blue,
                dash: Dash::Solid
            }
        );
    }
}
