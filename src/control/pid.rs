//! PID with a filtered derivative, an output clamp, and an integrator that stops at the clamp.
//!
//! `u = Kp f + Ki int(f) + Kd s / (1 + tau s) f` of the scaled error `f`. The integral adds the present error; the
//! derivative is discretised by the bilinear rule, which keeps its phase up to the loop's crossover. The integral is
//! held in volts, so that a change of Ki does not move the output.

use crate::scalar::{Quantity, Scalar};

pub use super::popov::PidGains;

/// The PID ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Pid<S: Scalar> {
    proportional: S::Gain,
    integral_per_tick: S::Gain,
    derivative: S::Gain,
    derivative_pole: S,
    /// The change of the scaled error in a tick that keeps a derivative as it is.
    steady_change: S::Gain,
    integral_limit: S,
    error_limit: S,
}

/// The memory of a PID.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PidState<S: Scalar> {
    integral: S::Sum,
    derivative: S,
    last_error: S,
}

/// What a PID put out, term by term, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PidTerms<S> {
    /// Kp f.
    pub proportional: S,
    /// The integral.
    pub integral: S,
    /// The filtered derivative.
    pub derivative: S,
    /// The sum, within the bounds given to the step.
    pub output: S,
    /// Whether the bounds cut the output.
    pub saturated: bool,
}

/// The largest scaled error that the PID acts on, mm: what [`Quantity::Length`] holds in fixed point, so that all
/// number types see the same.
const ERROR_LIMIT_MM: f64 = 31.0;

impl<S: Scalar> Pid<S> {
    /// Makes the PID for a control period. The integral stays within +-`integral_limit_v`. Settings time only.
    pub fn build(gains: &PidGains, integral_limit_v: f64, period_s: f64) -> Self {
        let filter = 2.0 * gains.derivative_filter_s + period_s;
        let gain = |value| S::gain(value, Quantity::Length, Quantity::Voltage);
        // Finite without a derivative, too, where it does not matter.
        let steady_change = (period_s / gains.kd_v_s_per_mm).min(1e6);
        Self {
            proportional: gain(gains.kp_v_per_mm),
            integral_per_tick: gain(gains.ki_v_per_mm_s * period_s),
            derivative: gain(2.0 * gains.kd_v_s_per_mm / filter),
            derivative_pole: S::quantise(
                (2.0 * gains.derivative_filter_s - period_s) / filter,
                Quantity::Fraction,
            ),
            steady_change: S::gain(steady_change, Quantity::Voltage, Quantity::Length),
            integral_limit: S::quantise(integral_limit_v, Quantity::Voltage),
            error_limit: S::quantise(ERROR_LIMIT_MM, Quantity::Length),
        }
    }

    /// Forgets the past: no integral, and no derivative kick at the next step from the present scaled error.
    pub fn reset(&self, state: &mut PidState<S>, error: S) {
        *state = PidState {
            last_error: error.limit(-self.error_limit, self.error_limit),
            ..PidState::default()
        };
    }

    /// Takes over the memory of a PID with other gains, or of one that saw another scaled error: the next step, from
    /// the scaled error given, leaves the derivative as it is.
    #[inline(always)]
    pub fn take_over(&self, state: &mut PidState<S>, error: S) {
        let error = error.limit(-self.error_limit, self.error_limit);
        state.last_error = error - state.derivative.scale(self.steady_change);
    }

    /// One control period. `error` is the scaled error f(e) in mm; the output stays within `low..=high` (V), which
    /// must be ordered. While it is cut, the integral takes no error that would push it further out, so it starts
    /// back with the first error of the other sign.
    #[inline(always)]
    pub fn step(&self, state: &mut PidState<S>, error: S, low: S, high: S) -> PidTerms<S> {
        let error = error.limit(-self.error_limit, self.error_limit);
        let proportional = error.scale(self.proportional);
        let derivative = state
            .derivative
            .times(self.derivative_pole, Quantity::Fraction)
            + (error - state.last_error).scale(self.derivative);
        state.derivative = derivative;
        state.last_error = error;

        let fast = proportional + derivative;
        let sum = error.accumulate(state.integral, self.integral_per_tick);
        let integral = S::total(sum);
        let wanted = fast + integral;
        let outward = if wanted > high {
            error > S::ZERO
        } else {
            wanted < low && error < S::ZERO
        };
        let integral = if outward {
            S::total(state.integral)
        } else {
            let bounded = integral.limit(-self.integral_limit, self.integral_limit);
            state.integral = if bounded == integral {
                sum
            } else {
                bounded.into_sum()
            };
            bounded
        };
        let wanted = fast + integral;
        let output = wanted.limit(low, high);
        PidTerms {
            proportional,
            integral,
            derivative,
            output,
            saturated: output != wanted,
        }
    }
}
