//! Colours of the page's figures, each with its counterpart on a dark page.
//!
//! Figures are stored in their light colours; the page's script swaps each for its dark counterpart when the
//! reader's device prefers a dark page. The series colours are those of Okabe and Ito, which readers with the usual forms
//! of colour blindness can tell apart; yellow is left out, because thin yellow lines vanish on white paper.

use serde::{Deserialize, Serialize};

/// The colour of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Colour {
    /// Black, or nearly white on a dark page: for references and recorded data.
    Ink,
    /// Blue.
    Blue,
    /// Vermillion.
    Vermillion,
    /// Bluish green.
    Green,
    /// Orange.
    Orange,
    /// Reddish purple.
    Purple,
    /// Sky blue.
    Sky,
    /// Grey, for what should stay in the background.
    Grey,
}

impl Colour {
    /// The order in which [`super::Style::nth`] hands the colours out.
    pub(super) const CYCLE: [Self; 6] = [
        Self::Blue,
        Self::Vermillion,
        Self::Green,
        Self::Purple,
        Self::Orange,
        Self::Sky,
    ];

    /// The colour on a light page.
    pub(super) const fn light(self) -> &'static str {
        match self {
            Self::Ink => INK.0,
            Self::Blue => "#0072b2",
            Self::Vermillion => "#d55e00",
            Self::Green => "#009e73",
            Self::Orange => "#e69f00",
            Self::Purple => "#cc79a7",
            Self::Sky => "#56b4e9",
            Self::Grey => "#8a8a8a",
        }
    }
}

impl Colour {
    /// The colour on a dark page.
    pub(super) fn dark(self) -> &'static str {
        let light = self.light();
        PAIRS
            .iter()
            .find(|pair| pair.0 == light)
            .map_or(light, |pair| pair.1)
    }
}

/// Text, axes and reference curves: on a light page, on a dark page.
pub(super) const INK: (&str, &str) = ("#1b1b1b", "#e4e4e1");
/// Axis texts.
pub(super) const LABEL: (&str, &str) = ("#444444", "#b9b9b4");
/// Grid lines.
pub(super) const GRID: (&str, &str) = ("#e6e6e3", "#33353a");
/// Zero lines, frames and nominal shapes.
pub(super) const RULE: (&str, &str) = ("#a9a9a5", "#6b6e75");
/// The page itself, behind hover labels.
pub(super) const PAPER: (&str, &str) = ("#ffffff", "#16181c");

/// Every light colour of the figures with its dark counterpart.
pub(super) const PAIRS: [(&str, &str); 12] = [
    INK,
    LABEL,
    GRID,
    RULE,
    PAPER,
    // The dark blues are lifted, or thin lines would drown; sky blue follows, to stay apart from blue.
    (Colour::Blue.light(), "#3f9fe0"),
    (Colour::Vermillion.light(), "#f0752a"),
    (Colour::Green.light(), "#1fbf92"),
    (Colour::Orange.light(), "#f0b429"),
    (Colour::Purple.light(), "#dd94bd"),
    (Colour::Sky.light(), "#a5dcf8"),
    (Colour::Grey.light(), "#8d9097"),
];

#[cfg(test)]
mod tests {
    use super::{Colour, PAIRS};

    #[test]
    fn every_series_colour_has_a_dark_counterpart() {
        for colour in Colour::CYCLE.into_iter().chain([Colour::Ink, Colour::Grey]) {
            assert_ne!(colour.light(), colour.dark(), "{colour:?}");
        }
    }

    #[test]
    fn no_colour_stands_for_two() {
        for (i, a) in PAIRS.iter().enumerate() {
            assert!(
                PAIRS[i + 1..].iter().all(|b| a.0 != b.0 && a.1 != b.1),
                "{a:?}"
            );
        }
    }
}
