//! The filtered derivative that every law has: `Kd s / (1 + tau s)`, by the bilinear rule, which keeps its phase up to
//! the loop's crossover.

use super::terms::FeedbackState;
use crate::scalar::{Quantity, Scalar};

/// The largest error that a law acts on, mm: what [`Quantity::Length`] holds in fixed point, so that all number types
/// see the same.
const ERROR_LIMIT_MM: f64 = 31.0;

/// The derivative ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Derivative<S: Scalar> {
    gain: S::Gain,
    pole: S,
    /// The change of the error in a tick that keeps a derivative as it is.
    steady_change: S::Gain,
    error_limit: S,
}

impl<S: Scalar> Derivative<S> {
    /// Makes `kd_v_s_per_mm` s / (1 + `filter_s` s) for a control period. Settings time only.
    pub(super) fn build(kd_v_s_per_mm: f64, filter_s: f64, period_s: f64) -> Self {
        let filter = 2.0 * filter_s + period_s;
        // Finite without a derivative, too, where it does not matter.
        let steady_change = (period_s / kd_v_s_per_mm).min(1e6);
        Self {
            gain: S::gain(
                2.0 * kd_v_s_per_mm / filter,
                Quantity::Length,
                Quantity::Voltage,
            ),
            pole: S::quantise((2.0 * filter_s - period_s) / filter, Quantity::Fraction),
            steady_change: S::gain(steady_change, Quantity::Voltage, Quantity::Length),
            error_limit: S::quantise(ERROR_LIMIT_MM, Quantity::Length),
        }
    }

    /// The error that a law acts on; one that is not a number counts as none.
    pub(super) fn clip(&self, error: S) -> S {
        error.within(self.error_limit)
    }

    /// Forgets the past: no kick at the next step from the present error.
    pub(super) fn reset(&self, state: &mut FeedbackState<S>, error: S) {
        *state = FeedbackState {
            last_error: self.clip(error),
            ..FeedbackState::default()
        };
    }

    /// Adopts the memory of another law: the next step, from the error given, leaves the derivative as it is.
    pub(super) fn take_over(&self, state: &mut FeedbackState<S>, error: S) {
        state.last_error = self.clip(error) - state.derivative.scale(self.steady_change);
    }

    /// One control period from an error that [`Self::clip`] has passed; V.
    #[inline(always)]
    pub(super) fn step(&self, state: &mut FeedbackState<S>, error: S) -> S {
        let derivative = state.derivative.times(self.pole, Quantity::Fraction)
            + (error - state.last_error).scale(self.gain);
        state.derivative = derivative;
        state.last_error = error;
        derivative
    }
}
