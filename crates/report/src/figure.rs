//! Figures, and their translation into plotly's description.

use super::dots::Dots;
use super::lines::Lines;
use super::mark::Entry;
use super::polar::PolarDeviation;
use super::{Colour, ReportError, palette};
use plotly::Plot as Plotly;
use plotly::common::{Anchor, DashType, Font, Line, Orientation, Title};
use plotly::layout::{Axis, Layout, Legend, Margin};
use serde::{Deserialize, Serialize};

/// A drawing with its caption.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Unique on its page; also the name of the image a reader saves.
    pub id: String,
    /// What the figure shows.
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

/// How a curve is drawn.
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
    /// Name and sample of everything drawn, in drawing order.
    pub(super) fn legend(&self) -> Vec<Entry<'_>> {
        match &self.plot {
            Plot::Lines(lines) => lines.legend(),
            Plot::PolarDeviation(circle) => circle.legend(),
            Plot::Dots(dots) => dots.legend(),
        }
    }

    /// What follows the caption because the drawing cannot be read without it.
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

    /// The figure as plotly's JSON, with every sample.
    pub(super) fn to_plotly(&self) -> Plotly {
        match &self.plot {
            Plot::Lines(lines) => lines.to_plotly(),
            Plot::PolarDeviation(circle) => circle.to_plotly(),
            Plot::Dots(dots) => dots.to_plotly(),
        }
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

/// A text as it is printed: with the micro sign, which plain text does without. The word "us" is taken for a unit.
pub(super) fn typeset(label: &str) -> String {
    label
        .split_inclusive(|c: char| !c.is_alphanumeric())
        .map(|word| match word.strip_prefix('u') {
            Some(rest)
                if matches!(
                    rest.trim_end_matches(|c: char| !c.is_alphanumeric()),
                    "m" | "V" | "s"
                ) =>
            {
                format!("µ{rest}")
            }
            _ => word.to_owned(),
        })
        .collect()
}

/// The line of a curve.
pub(super) fn trace_line(style: Style) -> Line {
    let dash = match style.dash {
        Dash::Solid | Dash::Points => DashType::Solid,
        Dash::Dashed => DashType::Dash,
        Dash::Dotted => DashType::Dot,
    };
    Line::new()
        .width(1.3)
        .color(style.colour.light())
        .dash(dash)
        // Curves are thinned here, and to the eye; the library's own thinning makes smooth ones angular.
        .simplify(false)
}

/// What all axes share.
pub(super) fn axis(label: &str) -> Axis {
    Axis::new()
        .title(Title::with_text(typeset(label)).font(Font::new().size(13).color(palette::INK.0)))
        .tick_font(Font::new().size(11).color(palette::LABEL.0))
        .tick_color(palette::RULE.0)
        .grid_color(palette::GRID.0)
        .show_line(true)
        .line_color(palette::RULE.0)
        .auto_margin(true)
}

/// What all drawings share.
pub(super) fn layout() -> Layout {
    Layout::new()
        .font(
            Font::new()
                .family("system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif")
                .color(palette::INK.0),
        )
        .paper_background_color("rgba(0,0,0,0)")
        .plot_background_color("rgba(0,0,0,0)")
        .margin(Margin::new().left(56).right(12).top(8).bottom(44))
        // The page has a legend of its own, which wraps on a narrow screen; saved images get this one.
        .show_legend(false)
        .legend(
            Legend::new()
                .orientation(Orientation::Horizontal)
                .x(0.0)
                .x_anchor(Anchor::Left)
                .y(1.02)
                .y_anchor(Anchor::Bottom)
                .font(Font::new().size(12).color(palette::INK.0)),
        )
}

#[cfg(test)]
mod tests {
    use super::{Dash, Figure, Plot, Style, typeset};
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
        let json = figure(
            vec![0.0, 0.1 + 0.2, 1.0],
            vec![0.123_456_789, f64::NAN, 1.0],
        )
        .to_plotly()
        .to_json();
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

    #[test]
    fn micro_is_printed_in_units_only() {
        assert_eq!(typeset("tracking error (um)"), "tracking error (µm)");
        assert_eq!(typeset("um/s"), "µm/s");
        assert_eq!(typeset("sum of um, uV"), "sum of µm, µV");
        assert_eq!(typeset("us per umbra"), "µs per umbra");
    }
}
