//! A figure as it is drawn: what the script of the page and the image files have in common.

use serde::Serialize;

use super::{Colour, Scale};

/// The curves of a figure on their axes, digits beyond the drawing's resolution left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Drawing {
    pub(super) caption: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// True if one unit is as long on both axes.
    pub(super) equal: bool,
    /// In the order of the legend; later ones are drawn over earlier ones.
    pub(super) curves: Vec<Curve>,
    /// Circles about the origin, behind the curves.
    pub(super) circles: Vec<Circle>,
    pub(super) texts: Vec<Text>,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Axis {
    pub(super) label: String,
    /// True if the scale is logarithmic.
    pub(super) log: bool,
    /// Ends, in values; without them the axis fits the curves that are shown.
    pub(super) range: Option<(f64, f64)>,
    /// Room beyond the curves on either side, as a share of what they span.
    pub(super) margin: f64,
    /// Positions with their labels; round numbers if there are none.
    pub(super) ticks: Vec<(f64, String)>,
    /// True if lines cross the drawing at the ticks.
    pub(super) grid: bool,
    /// True if a line crosses the drawing at zero.
    pub(super) zero: bool,
}

/// Curve of one entry of the legend.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Curve {
    pub(super) name: String,
    /// On a light page, on a dark page.
    pub(super) colour: (&'static str, &'static str),
    pub(super) shape: Shape,
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
}

/// The mark of a measured point: a circle of 2.4 px about the middle.
pub(super) const MARK: &str = "m-2.4 0a2.4 2.4 0 1 0 4.8 0a2.4 2.4 0 1 0 -4.8 0z";

/// The shape of a curve. A mark is an outline in relative SVG path commands.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub(super) enum Shape {
    Line {
        /// Lengths of dashes and gaps, px.
        dash: Option<&'static str>,
        /// Radial deviation at each sample of a circle, um.
        #[serde(skip_serializing_if = "Option::is_none")]
        deviation: Option<Vec<f64>>,
    },
    Points {
        mark: &'static str,
    },
}

/// A circle about the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Circle {
    pub(super) radius: f64,
    /// True for the circle that deviations are measured from.
    pub(super) nominal: bool,
}

/// A text in the drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Text {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Distance of the base line below the position, px.
    pub(super) dy: f64,
    /// SVG's `text-anchor`.
    pub(super) anchor: &'static str,
    pub(super) text: String,
}

impl Axis {
    /// An axis with a line at zero that fits its curves.
    pub(super) fn new(label: &str, scale: Scale) -> Self {
        Self {
            label: typeset(label),
            log: scale == Scale::Logarithmic,
            range: None,
            margin: 0.0,
            ticks: Vec::new(),
            grid: false,
            zero: true,
        }
    }

    pub(super) fn scale(&self) -> Scale {
        if self.log {
            Scale::Logarithmic
        } else {
            Scale::Linear
        }
    }
}

impl Curve {
    pub(super) fn new(
        name: &str,
        colour: Colour,
        shape: Shape,
        (x, y): (Vec<f64>, Vec<f64>),
    ) -> Self {
        Self {
            name: name.to_owned(),
            colour: (colour.light(), colour.dark()),
            shape,
            x,
            y,
        }
    }

    /// Runs of samples without a gap.
    pub(super) fn runs(&self) -> Vec<Vec<usize>> {
        let samples: Vec<usize> = (0..self.x.len()).collect();
        samples
            .split(|&i| !(self.x[i].is_finite() && self.y[i].is_finite()))
            .filter(|run| !run.is_empty())
            .map(<[usize]>::to_vec)
            .collect()
    }
}

/// Returns a text as it is printed: with the micro sign, which plain text does without. The word "us" is taken for a unit.
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

#[cfg(test)]
mod tests {
    use super::typeset;

    #[test]
    fn micro_is_printed_in_units_only() {
        assert_eq!(typeset("tracking error (um)"), "tracking error (µm)");
        assert_eq!(typeset("um/s"), "µm/s");
        assert_eq!(typeset("sum of um, uV"), "sum of µm, µV");
        assert_eq!(typeset("us per umbra"), "µs per umbra");
    }
}
