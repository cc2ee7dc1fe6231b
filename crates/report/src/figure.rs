//! Figures: a caption and one of the kinds of drawing.

use serde::Serialize;

use super::ReportError;
use super::drawing::Drawing;
use super::lines::Lines;
use super::polar::PolarDeviation;

/// A drawing with its caption.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Unique on its page; also the name of the image a reader saves.
    pub id: String,
    /// Caption: the subject of the figure.
    pub caption: String,
    /// The drawing.
    pub plot: Plot,
}

/// The kinds of drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Plot {
    /// Curves over a common axis, or paths in a plane.
    Lines(Lines),
    /// Radial deviation from a circle.
    PolarDeviation(PolarDeviation),
}

impl Figure {
    /// Number of entries in the legend.
    pub(super) fn curve_count(&self) -> usize {
        match &self.plot {
            Plot::Lines(lines) => lines.series.len(),
            Plot::PolarDeviation(circle) => circle.traces.len(),
        }
    }

    /// Returns the note that follows the caption because the drawing cannot be read without it.
    pub(super) fn note(&self) -> Option<String> {
        match &self.plot {
            Plot::Lines(_) => None,
            Plot::PolarDeviation(circle) => Some(circle.scale_note()),
        }
    }

    pub(super) fn check(&self) -> Result<(), ReportError> {
        match &self.plot {
            Plot::Lines(lines) => lines.check(&self.id),
            Plot::PolarDeviation(circle) => circle.check(&self.id),
        }
    }

    /// The same with at most `points` samples of each curve; no spike is lost.
    pub(super) fn decimated(&self, points: usize) -> Self {
        let plot = match &self.plot {
            Plot::Lines(lines) => Plot::Lines(lines.decimated(points)),
            Plot::PolarDeviation(circle) => Plot::PolarDeviation(circle.decimated(points)),
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
        };
        drawing.caption.clone_from(&self.caption);
        drawing
    }
}

#[cfg(test)]
mod tests {
    use super::{Figure, Plot};
    use crate::{Lines, ReportError, Series, Style};

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
}
