//! Curves over a common axis, and paths in a plane.

use super::drawing::{Axis, Curve, Drawing, Shape};
use super::mark::Mark;
use super::samples::{pick, same_length};
use super::{Colour, Dash, ReportError, Scale, Style, decimate};
use serde::{Deserialize, Serialize};

/// Curves over a common axis, or paths in a plane.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    #[serde(default)]
    pub y_range: Option<(f64, f64)>,
    /// Shaded bands, behind the curves.
    #[serde(default)]
    pub bands: Vec<Band>,
}

/// One curve. Samples that are not finite are gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// Abscissas.
    #[serde(with = "super::number::list")]
    pub x: Vec<f64>,
    /// Ordinates, as many.
    #[serde(with = "super::number::list")]
    pub y: Vec<f64>,
    /// Style of the curve.
    pub style: Style,
}

/// A shaded band between two curves. Samples that are not finite are gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// For the legend.
    pub name: String,
    /// Abscissas, in order.
    #[serde(with = "super::number::list")]
    pub x: Vec<f64>,
    /// Its lower edge, as many ordinates.
    #[serde(with = "super::number::list")]
    pub low: Vec<f64>,
    /// Its upper edge, as many ordinates.
    #[serde(with = "super::number::list")]
    pub high: Vec<f64>,
    /// Colour of the shade.
    pub colour: Colour,
}

impl Band {
    /// The same with about `points` samples, among them the extremes of both edges.
    fn decimated(&self, points: usize) -> Self {
        let mut kept = decimate(&self.x, &self.low, points / 2);
        kept.extend(decimate(&self.x, &self.high, points / 2));
        kept.sort_unstable();
        kept.dedup();
        Self {
            name: self.name.clone(),
            x: pick(&self.x, &kept),
            low: pick(&self.low, &kept),
            high: pick(&self.high, &kept),
            colour: self.colour,
        }
    }
}

impl Lines {
    pub(super) fn check(&self, figure: &str) -> Result<(), ReportError> {
        for band in &self.bands {
            same_length(figure, &band.name, band.x.len(), band.low.len())?;
            same_length(figure, &band.name, band.x.len(), band.high.len())?;
        }
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
            bands: self.bands.iter().map(|b| b.decimated(points)).collect(),
            ..*self
        }
    }

    /// All abscissas.
    pub(super) fn abscissas(&self) -> impl Iterator<Item = f64> {
        let bands = self.bands.iter().flat_map(|band| &band.x);
        bands
            .chain(self.series.iter().flat_map(|series| &series.x))
            .copied()
    }

    /// All ordinates.
    pub(super) fn ordinates(&self) -> impl Iterator<Item = f64> {
        let bands = self.bands.iter();
        bands
            .flat_map(|band| band.low.iter().chain(&band.high))
            .chain(self.series.iter().flat_map(|series| &series.y))
            .copied()
    }

    pub(super) fn drawing(&self) -> Drawing {
        // A hundred-thousandth of what an axis spans is a hundredth of a pixel: digits beyond it only cost bytes. The
        // abscissas keep one digit more, for zooming into a long run.
        let x_step = 1e-6 * self.x_scale.span(self.abscissas());
        let y_step = 1e-5 * self.y_scale.span(self.ordinates());
        let short_x = |values: &[f64]| self.x_scale.shortened(values, x_step);
        let short_y = |values: &[f64]| self.y_scale.shortened(values, y_step);
        let bands = self.bands.iter().map(|band| {
            let shape = Shape::Band {
                high: short_y(&band.high),
            };
            let edge = (short_x(&band.x), short_y(&band.low));
            Curve::new(&band.name, band.colour, shape, edge)
        });
        let series = self.series.iter().map(|series| {
            let shape = match series.style.dash {
                Dash::Points => Shape::Points {
                    mark: Mark::Circle.outline(2.4),
                },
                dash => Shape::Line {
                    dash: dash.pattern(),
                    deviation: None,
                },
            };
            let samples = (short_x(&series.x), short_y(&series.y));
            Curve::new(&series.name, series.style.colour, shape, samples)
        });
        let curves = bands.chain(series).collect();
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
            curves,
            circles: Vec::new(),
            texts: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Band, Lines, Series};
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

    #[test]
    fn bands_break_at_gaps_and_keep_their_extremes() {
        let n = 5000;
        let mut low = vec![-1.0; n];
        low[1234] = -9.0;
        let mut high = vec![1.0; n];
        high[4321] = 9.0;
        high[2500] = f64::NAN;
        let band = Band {
            name: "spread".to_owned(),
            x: (0..n).map(|i| i as f64).collect(),
            low,
            high,
            colour: Colour::Sky,
        };
        let thin = band.decimated(200);
        assert!(thin.x.len() <= 200, "{}", thin.x.len());
        assert!(thin.low.contains(&-9.0) && thin.high.contains(&9.0));
        let lines = Lines {
            bands: vec![thin],
            ..Lines::default()
        };
        let runs = lines.drawing().curves[0].runs();
        assert_eq!(runs.len(), 2);
        assert!(
            runs.concat()
                .iter()
                .all(|&i| lines.bands[0].high[i].is_finite())
        );
    }
}
