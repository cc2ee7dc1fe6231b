//! Curves over a common axis, and paths in a plane.

use super::figure::{axis, layout, trace_line};
use super::polar::rounded;
use super::{Dash, Style, decimate, palette};
use plotly::common::{Marker, Mode};
use plotly::layout::{Axis, AxisType, DragMode, HoverMode, TicksDirection};
use plotly::{Plot as Plotly, Scatter};

/// Curves over a common axis, or paths in a plane.
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// Names at 0, 1, 2 ... of the horizontal axis, in place of numbers; none for an ordinary axis.
    pub x_names: Vec<String>,
}

/// The scale of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// Even.
    #[default]
    Linear,
    /// Decades; samples of zero and below are gaps.
    Logarithmic,
}

/// One curve. Samples that are not finite are gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// Abscissas.
    pub x: Vec<f64>,
    /// Ordinates, as many.
    pub y: Vec<f64>,
    /// How it is drawn.
    pub style: Style,
}

impl Scale {
    /// Where a value lies on the axis, in any even unit.
    fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic if value > 0.0 => value.log10(),
            Self::Logarithmic => f64::NAN,
        }
    }

    fn apply(self, axis: Axis) -> Axis {
        match self {
            Self::Linear => axis,
            Self::Logarithmic => axis.type_(AxisType::Log),
        }
    }
}

impl Lines {
    pub(super) fn to_plotly(&self, points_per_series: usize) -> Plotly {
        let mut plot = Plotly::new();
        let places = |scale: Scale, values: &[f64]| -> Vec<f64> {
            values.iter().map(|&value| scale.place(value)).collect()
        };
        // A hundred-thousandth of what an axis spans is a hundredth of a pixel: digits beyond it only cost bytes. The
        // abscissas keep one digit more, for zooming into a long run.
        let x_span = span(self.x_scale, self.series.iter().flat_map(|s| &s.x));
        let y_span = span(self.y_scale, self.series.iter().flat_map(|s| &s.y));
        for series in &self.series {
            let kept = decimate(
                &places(self.x_scale, &series.x),
                &places(self.y_scale, &series.y),
                points_per_series,
            );
            let shorten = |scale: Scale, values: &[f64], step: f64| -> Vec<f64> {
                kept.iter()
                    .map(|&index| match scale {
                        Scale::Linear => rounded(values[index], step),
                        // On decades a step is a share of the value.
                        Scale::Logarithmic if values[index] > 0.0 => {
                            rounded(values[index], step * values[index])
                        }
                        Scale::Logarithmic => f64::NAN,
                    })
                    .collect()
            };
            let x = shorten(self.x_scale, &series.x, 1e-6 * x_span);
            let y = shorten(self.y_scale, &series.y, 1e-5 * y_span);
            let trace = Scatter::new(x, y).name(&series.name);
            plot.add_trace(match series.style.dash {
                Dash::Points => trace
                    .mode(Mode::Markers)
                    .marker(Marker::new().size(5).color(series.style.colour.light())),
                Dash::Solid | Dash::Dashed | Dash::Dotted => {
                    trace.mode(Mode::Lines).line(trace_line(series.style))
                }
            });
        }
        let x_axis = axis(&self.x_label)
            .show_grid(self.x_scale == Scale::Logarithmic)
            .zero_line_color(palette::RULE.0)
            .ticks(TicksDirection::Outside);
        let x_axis = if self.x_names.is_empty() {
            x_axis
        } else {
            x_axis
                .tick_values((0..self.x_names.len()).map(|place| place as f64).collect())
                .tick_text(self.x_names.clone())
        };
        let y_axis = axis(&self.y_label).zero_line_color(palette::RULE.0);
        let y_axis = if self.equal_units {
            y_axis.scale_anchor("x")
        } else {
            y_axis
        };
        let layout = layout()
            .x_axis(self.x_scale.apply(x_axis))
            .y_axis(self.y_scale.apply(y_axis))
            .drag_mode(DragMode::Zoom)
            .hover_mode(HoverMode::Closest);
        plot.set_layout(layout);
        plot
    }
}

/// What the values span on their axis.
fn span<'a>(scale: Scale, values: impl Iterator<Item = &'a f64>) -> f64 {
    let (low, high) = values
        .map(|&value| scale.place(value))
        .filter(|place| place.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(place), high.max(place))
        });
    high - low
}

#[cfg(test)]
mod tests {
    use super::{Lines, Scale, Series};
    use crate::report::{Colour, Style};

    fn json(lines: Lines) -> String {
        lines.to_plotly(100).to_json()
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
    fn on_decades_digits_are_a_share_of_the_value_and_zero_is_a_gap() {
        let json = json(Lines {
            x_scale: Scale::Logarithmic,
            y_scale: Scale::Logarithmic,
            ..lines(Style::solid(Colour::Blue))
        });
        assert!(json.contains("\"x\":[null,1.0,10.0]"), "{json}");
        assert!(json.contains("123.457"), "{json}");
        assert!(json.contains("\"type\":\"log\""), "{json}");
    }

    #[test]
    fn points_are_marks_and_not_joined() {
        let json = json(lines(Style::points(Colour::Blue)));
        assert!(json.contains("\"mode\":\"markers\""), "{json}");
    }

    #[test]
    fn names_stand_where_numbers_would() {
        let json = json(Lines {
            x_names: vec!["nominal".to_owned(), "cold".to_owned()],
            ..lines(Style::points(Colour::Blue))
        });
        assert!(
            json.contains("\"ticktext\":[\"nominal\",\"cold\"]"),
            "{json}"
        );
        assert!(json.contains("\"tickvals\":[0.0,1.0]"), "{json}");
    }

    #[test]
    fn equal_units_tie_the_axes_together() {
        let json = json(Lines {
            equal_units: true,
            ..lines(Style::solid(Colour::Blue))
        });
        assert!(json.contains("\"scaleanchor\":\"x\""), "{json}");
    }
}
