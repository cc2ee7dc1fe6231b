//! Errors of the identification of pre-sliding friction.

use quadrant_law::friction::gms::MAX_ELEMENTS;

use crate::identify::fit::FitError;

/// Reasons for which a recording gives no GMS model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VirginCurveError {
    /// The axis did not turn round often enough.
    #[error(
        "the axis turned round {reversals} times; the hysteresis takes at least 4: record more cycles, or a larger amplitude if the \
         axis hardly moved ({travel_um:.1} um)"
    )]
    TooFewReversals {
        /// Number of reversals found.
        reversals: usize,
        /// Distance moved, um.
        travel_um: f64,
    },
    /// The friction never reached its plateau.
    #[error(
        "the axis moved by {travel_um:.1} um and its friction was still rising at {reached_v:.4} V: it never slid, and the curve's end \
         is unknown. A sine of about {needed_um:.0} um would reach the plateau"
    )]
    NoPlateau {
        /// Distance moved, um.
        travel_um: f64,
        reached_v: f64,
        /// The amplitude that would do.
        needed_um: f64,
    },
    /// A number of elements, or knots, that cannot be.
    #[error(
        "{count} elements; a GMS model has 1 to {MAX_ELEMENTS}, with knots that rise from above zero"
    )]
    Elements {
        /// Number of elements asked for.
        count: usize,
    },
    #[error(transparent)]
    Fit(#[from] FitError),
}
