//! The nonlinear gain of N-PID: `k(e) = cosh(ko sat(e, emax))`.
//!
//! The PID acts on the scaled error `f(e) = k(e) e`, so the loop is stiff where the error is large and keeps its linear
//! margins where it is small: `1 <= k(e) <= cosh(ko emax)`.

use super::pid::Pid;
use crate::scalar::{Quantity, Scalar};
use crate::table::OctaveTable;

/// The nonlinear gain as a person writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct NonlinearGain {
    /// ko, the rate of variation, 1/mm.
    pub rate_per_mm: f64,
    /// emax, the range of variation: the error from which the gain stays at its largest, mm.
    pub range_mm: f64,
}

impl NonlinearGain {
    /// k(e) by the formula. Settings time and host only.
    pub fn at(&self, error_mm: f64) -> f64 {
        libm::cosh(self.rate_per_mm * libm::fabs(error_mm).min(self.range_mm))
    }

    /// cosh(ko emax), the largest gain.
    pub fn largest(&self) -> f64 {
        self.at(self.range_mm)
    }
}

/// The nonlinear gain ready for the tick.
///
/// ```
/// use quadrant_law::control::npid::{NonlinearGain, NonlinearGainTable};
///
/// let gain = NonlinearGain { rate_per_mm: 100.0, range_mm: 0.01 };
/// let table = NonlinearGainTable::<f64>::build(&gain);
/// assert_eq!(table.at(0.0), 1.0);
/// // From emax on the gain stays at cosh(ko emax).
/// assert_eq!(table.at(0.02), gain.largest());
/// assert_eq!(table.scaled_error(-0.02), -0.02 * gain.largest());
/// ```
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct NonlinearGainTable<S: Scalar> {
    largest: S,
    table: OctaveTable<S, 1>,
}

/// A PID behind the nonlinear gain. What every tick reads comes before the table, within reach of one address.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct NonlinearPid<S: Scalar> {
    /// Acts on the scaled error.
    pub pid: Pid<S>,
    /// Scales the error.
    pub gain: NonlinearGainTable<S>,
}

impl<S: Scalar> NonlinearGainTable<S> {
    /// Tabulates the gain. Settings time only.
    pub fn build(gain: &NonlinearGain) -> Self {
        Self {
            table: OctaveTable::build(
                gain.range_mm,
                Quantity::Length,
                [Quantity::Multiplier],
                // Not clipped at emax: the kink would fall within an interval.
                |error| [libm::cosh(gain.rate_per_mm * error)],
            ),
            largest: S::quantise(gain.largest(), Quantity::Multiplier),
        }
    }

    /// k(e), from 1 to cosh(ko emax).
    #[inline(always)]
    pub fn at(&self, error: S) -> S {
        let [gain] = self.table.at(error.magnitude());
        // Chords lie above a convex curve, which rises beyond emax, too; the bound of the Popov criterion holds exactly.
        if gain < self.largest {
            gain
        } else {
            self.largest
        }
    }

    /// f(e) = k(e) e, mm.
    pub fn scaled_error(&self, error: S) -> S {
        error.times(self.at(error), Quantity::Multiplier)
    }
}
