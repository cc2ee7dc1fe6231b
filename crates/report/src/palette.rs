//! Colours of figures, each with its counterpart on a dark page.
//!
//! They are those of Okabe and Ito ("Color Universal Design", 2008), which readers with the usual forms of colour blindness
//! can distinguish; yellow is left out, because thin yellow lines vanish on white paper.

use serde::Serialize;

/// The colour of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
    /// The order in which [`super::Style::nth`] returns the colours.
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
            Self::Ink => "#1b1b1b",
            Self::Blue => "#0072b2",
            Self::Vermillion => "#d55e00",
            Self::Green => "#009e73",
            Self::Orange => "#e69f00",
            Self::Purple => "#cc79a7",
            Self::Sky => "#56b4e9",
            Self::Grey => "#8a8a8a",
        }
    }

    /// The colour on a dark page. Dark blues are lifted, or thin lines would drown; sky blue follows, to stay apart.
    pub(super) const fn dark(self) -> &'static str {
        match self {
            Self::Ink => "#e4e4e1",
            Self::Blue => "#3f9fe0",
            Self::Vermillion => "#f0752a",
            Self::Green => "#1fbf92",
            Self::Orange => "#f0b429",
            Self::Purple => "#dd94bd",
            Self::Sky => "#a5dcf8",
            Self::Grey => "#8d9097",
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::Colour;

    #[test]
    fn every_colour_stands_for_one_thing_on_every_page() {
        let all = Colour::CYCLE.into_iter().chain([Colour::Ink, Colour::Grey]);
        let mut seen = HashSet::new();
        for colour in all {
            assert!(
                seen.insert(colour.light()) && seen.insert(colour.dark()),
                "{colour:?}"
            );
        }
    }
}
