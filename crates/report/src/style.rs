//! Styles of curves: colour and dashes.

use serde::Serialize;

use super::Colour;

/// Style of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Style {
    /// Its colour.
    pub colour: Colour,
    /// Its dashes.
    pub dash: Dash,
}

/// The dashes of a line. Colour alone does not carry meaning in print.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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

impl Dash {
    /// Lengths of dashes and gaps, px, as SVG takes them.
    pub(super) const fn pattern(self) -> Option<&'static str> {
        match self {
            Self::Solid | Self::Points => None,
            Self::Dashed => Some("6 4"),
            Self::Dotted => Some("2 3"),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::{Dash, Style};
    use crate::Colour;

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
