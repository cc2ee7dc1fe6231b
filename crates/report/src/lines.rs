//! Curves over a common axis, and paths in a plane.

use super::drawing::{Axis, Curve, Drawing, MARK, Shape};
use super::samples::{pick, same_length};
use super::{Dash, ReportError, Scale, Style, decimate};
use serde::Serialize;

/// Curves over a common axis, or paths in a plane.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Lines {
    /// Horizontal axis, with its unit.
    pub x_label: String,
    /// Vertical axis, with its unit.
    pub y_label: String,
    /// The curves; later ones are drawn over earlier ones.
    pub series: Vec<Series>,
    /// Scale of the horizontal axis.
    pub x_scale: Scale,
    /// Scale of the vertical axis.
    pub y_scale: Scale,
    /// One unit is as long on both axes, as a Nyquist plot needs; for linear scales.
    pub equal_units: bool,
    /// Ends of the vertical axis, for figures that are compared; without them it fits the curves. For a linear scale.
    pub y_range: Option<(f64, f64)>,
}

/// One curve. Samples that are not finite are gaps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// Abscissas.
    #[serde(serialize_with = "super::number::list")]
    pub x: Vec<f64>,
    /// Ordinates, as many.
    #[serde(serialize_with = "super::number::list")]
    pub y: Vec<f64>,
    /// Style of the curve.
    pub style: Style,
}

impl Lines {
    pub(super) fn check(&self, figure: &str) -> Result<(), ReportError> {
        self.series
            .iter()
            .try_for_each(|s| same_length(figure, &s.name, s.x.len(), s.y.len()))
    }

    /// The same with at most `points` samples of each curve.
    pub(super) fn decimated(&self, points: usize) -> Self {
        let series = self.series.iter().map(|series| {
            let x = self.x_scale.places(&series.x);
            let kept = decimate(&x, &self.y_scale.places(&series.y), points);
            Series {
                name: series.name.clone(),
                x: pick(&series.x, &kept),
                y: pick(&series.y, &kept),
                style: series.style,
            }
        });
        Self {
            x_label: self.x_label.clone(),
            y_label: self.y_label.clone(),
            series: series.collect(),
            ..*self
        }
    }

    /// All abscissas.
    pub(super) fn abscissas(&self) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(|series| &series.x).copied()
    }

    /// All ordinates.
    pub(super) fn ordinates(&self) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(|series| &series.y).copied()
    }

    pub(super) fn drawing(&self) -> Drawing {
        // A hundred-thousandth of what an axis spans is a hundredth of a pixel: digits beyond it only cost bytes. The
        // abscissas keep one digit more, for zooming into a long run.
        let x_step = 1e-6 * self.x_scale.span(self.abscissas());
        let y_step = 1e-5 * self.y_scale.span(self.ordinates());
        let short_x = |values: &[f64]| self.x_scale.shortened(values, x_step);
        let short_y = |values: &[f64]| self.y_scale.shortened(values, y_step);
        let series = self.series.iter().map(|series| {
            let shape = match series.style.dash {
                Dash::Points => Shape::Points { mark: MARK },
                dash => Shape::Line {
                    dash: dash.pattern(),
                    deviation: None,
                },
            };
            let samples = (short_x(&series.x), short_y(&series.y));
            Curve::new(&series.name, series.style.colour, shape, samples)
        });
        let has_points = self.series.iter().any(|s| s.style.dash == Dash::Points);
        let x = Axis {
            // Curves over time begin at the axis; marks, and paths in a plane, need room on all sides.
            margin: if self.equal_units || has_points {
                0.03
            } else {
                0.0
            },
            grid: self.equal_units || self.x_scale == Scale::Logarithmic,
            ..Axis::new(&self.x_label, self.x_scale)
        };
        let y = Axis {
            range: self.y_range,
            margin: 0.05,
            grid: true,
            ..Axis::new(&self.y_label, self.y_scale)
        };
        Drawing {
            caption: String::new(),
            x,
            y,
            equal: self.equal_units,
            curves: series.collect(),
            circles: Vec::new(),
            texts: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Lines, Series};
    use crate::{Colour, Scale, Style};

    fn json(lines: Lines) -> String {
        serde_json::to_string(&lines.decimated(100).drawing()).unwrap()
    }

    fn lines(style: Style) -> Lines {
        Lines {
            series: vec![Series {
                name: "measured".to_owned(),
                x: vec![0.0, 1.0, 10.0],
                y: vec![1.0, 123.456_789, 1e4],
                style,
            }],
            ..Lines::default()
        }
    }

    #[test]
    fn figures_that_are_compared_can_have_one_range() {
        let json = json(Lines {
            y_range: Some((-2.5, 2.5)),
            ..lines(Style::solid(Colour::Blue))
        });
        assert!(json.contains("\"range\":[-2.5,2.5]"), "{json}");
    }

    #[test]
    fn on_decades_digits_are_a_share_of_the_value_and_zero_is_a_gap() {
        let json = json(Lines {
            x_scale: Scale::Logarithmic,
            y_scale: Scale::Logarithmic,
            ..lines(Style::solid(Colour::Blue))
        });
        assert!(json.contains("\"x\":[null,1.0,10.0]"), "{json}");
        assert!(json.contains("123.457"), "{json}");
        assert!(json.contains("\"log\":true"), "{json}");
    }

    #[test]
    fn points_are_marks_and_not_joined() {
        let json = json(lines(Style::points(Colour::Blue)));
        assert!(json.contains("\"kind\":\"points\""), "{json}");
    }

    #[test]
    fn equal_units_tie_the_axes_together() {
        let json = json(Lines {
            equal_units: true,
            ..lines(Style::solid(Colour::Blue))
        });
        assert!(json.contains("\"equal\":true"), "{json}");
    }
}
