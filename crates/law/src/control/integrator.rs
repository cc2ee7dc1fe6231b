//! The end of every law: the integral is added, the output is cut to its bounds, and while it is cut the integral takes
//! nothing that would push it further out.

use crate::hint::cold_path;

use super::terms::{FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};

/// The integral ready for the tick. It is held in volts, so that a change of its gain does not move the output.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Integrator<S: Scalar> {
    per_tick: S::Gain,
    limit: S,
}

impl<S: Scalar> Integrator<S> {
    /// Makes the integral of a signal of quantity `of`, `gain` volts per unit of it and second, within +-`limit_v`;
    /// without a limit there is no integral. Settings time only.
    pub(super) fn build(gain: f64, of: Quantity, limit_v: f64, period_s: f64) -> Self {
        Self {
            per_tick: S::gain(gain * period_s, of, Quantity::Voltage),
            limit: S::quantise(limit_v, Quantity::Voltage),
        }
    }

    /// Closes a law: integrates `driver`, adds the other terms, and stays with `base` within +-`limit`, all in V. While the
    /// output is cut, the integral takes no driver that would push it further out, so it starts back with the first one of
    /// the other sign.
    #[inline(always)]
    pub(super) fn close(
        &self,
        state: &mut FeedbackState<S>,
        driver: S,
        (proportional, derivative): (S, S),
        (base, limit): (S, S),
    ) -> FeedbackTerms<S> {
        let fast = proportional + derivative;
        let sum = driver.accumulate(state.integral, self.per_tick);
        let integral = S::total(sum);
        let requested = fast + integral;
        // Most ticks: neither the output nor the integral is at a bound. Not so if either is not a number.
        if (requested + base).is_within(limit) && integral.is_within(self.limit) {
            state.integral = sum;
            return FeedbackTerms {
                proportional,
                integral,
                derivative,
                output: requested,
                saturated: false,
            };
        }
        cold_path();
        let (low, high) = (-limit - base, limit - base);
        let outward = if requested > high {
            driver > S::ZERO
        } else {
            requested < low && driver < S::ZERO
        };
        let integral = if outward {
            S::total(state.integral)
        } else {
            let bounded = integral.within(self.limit);
            state.integral = if bounded == integral {
                sum
            } else {
                bounded.into_sum()
            };
            bounded
        };
        let requested = fast + integral;
        let output = requested.limit(low, high);
        FeedbackTerms {
            proportional,
            integral,
            derivative,
            output,
            saturated: output != requested,
        }
    }
}
