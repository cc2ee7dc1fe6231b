//! Marks of points and samples of legends, drawn alike on the page and in image files.

use super::{Colour, Dash};
use maud::{Markup, html};
use plotly::common::MarkerSymbol;

/// The shape of a point. Colour alone does not carry meaning in print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Square,
    Diamond,
    Triangle,
    Cross,
}

impl Mark {
    /// The mark of the `index`th of several equal series.
    pub(super) const fn nth(index: usize) -> Self {
        const CYCLE: [Mark; 5] = [
            Mark::Circle,
            Mark::Square,
            Mark::Diamond,
            Mark::Triangle,
            Mark::Cross,
        ];
        CYCLE[index % CYCLE.len()]
    }

    pub(super) const fn plotly(self) -> MarkerSymbol {
        match self {
            Self::Circle => MarkerSymbol::Circle,
            Self::Square => MarkerSymbol::Square,
            Self::Diamond => MarkerSymbol::Diamond,
            Self::Triangle => MarkerSymbol::TriangleUp,
            Self::Cross => MarkerSymbol::X,
        }
    }

    /// The outline, as an SVG path about `x`, `y`, of about the area of a circle of radius `r`.
    pub(super) fn path(self, x: f64, y: f64, r: f64) -> String {
        let polygon = |corners: &[(f64, f64)]| {
            let corners: Vec<String> = corners
                .iter()
                .map(|(dx, dy)| format!("{:.2} {:.2}", x + r * dx, y + r * dy))
                .collect();
            format!("M{}Z", corners.join("L"))
        };
        match self {
            Self::Circle => format!(
                "M{:.2} {y:.2}a{r:.2} {r:.2} 0 1 0 {:.2} 0a{r:.2} {r:.2} 0 1 0 {:.2} 0Z",
                x - r,
                2.0 * r,
                -2.0 * r
            ),
            Self::Square => polygon(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
            Self::Diamond => polygon(&[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)]),
            Self::Triangle => polygon(&[(0.0, -1.25), (1.15, 0.8), (-1.15, 0.8)]),
            Self::Cross => polygon(&[
                (0.0, -0.45),
                (0.75, -1.2),
                (1.2, -0.75),
                (0.45, 0.0),
                (1.2, 0.75),
                (0.75, 1.2),
                (0.0, 0.45),
                (-0.75, 1.2),
                (-1.2, 0.75),
                (-0.45, 0.0),
                (-1.2, -0.75),
                (-0.75, -1.2),
            ]),
        }
    }
}

/// One line of a legend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entry<'a> {
    pub(super) name: &'a str,
    pub(super) colour: Colour,
    pub(super) sample: Sample,
}

/// What a legend shows beside a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sample {
    Line(Dash),
    Band,
    Mark(Mark),
}

/// The box a sample fills, px.
pub(super) const SAMPLE: (f64, f64) = (26.0, 10.0);

impl Sample {
    /// The sample as SVG elements within [`SAMPLE`], in the colour `paint`.
    pub(super) fn markup(self, paint: &str) -> Markup {
        let (width, height) = SAMPLE;
        match self {
            Self::Line(Dash::Points) => Self::Mark(Mark::Circle).markup(paint),
            Self::Line(dash) => html! {
                path d={ "M0 " (height / 2.0) "H" (width) } fill="none" stroke=(paint) stroke-width="2"
                    stroke-dasharray=[dash.pattern()] {}
            },
            Self::Band => html! {
                rect width=(width) height=(height) fill=(paint) fill-opacity=(BAND_OPACITY) {}
            },
            Self::Mark(mark) => html! {
                path d=(mark.path(width / 2.0, height / 2.0, 4.0)) fill=(paint) {}
            },
        }
    }
}

/// How opaque a shaded band is.
pub(super) const BAND_OPACITY: f64 = 0.22;

impl Dash {
    /// Lengths of dashes and gaps, px, for SVG.
    pub(super) const fn pattern(self) -> Option<&'static str> {
        match self {
            Self::Solid | Self::Points => None,
            Self::Dashed => Some("6 4"),
            Self::Dotted => Some("2 3"),
        }
    }
}
