//! PID with a filtered derivative, an output clamp, and an integrator that stops at the clamp.
//!
//! `u = Kp f + Ki int(f) + Kd s / (1 + tau s) f` of the scaled error `f`. The integral adds the present error. PD is the
//! same without an integral.

use super::derivative::Derivative;
use super::integrator::Integrator;
use super::terms::{FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};

/// The gains of a PID with filtered derivative, `Kp + Ki/s + Kd s / (1 + tau s)`, as its design yields them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct PidGains {
    /// Kp, V/mm. Above zero.
    pub kp_v_per_mm: f64,
    /// Ki, V/(mm s). Zero or more.
    pub ki_v_per_mm_s: f64,
    /// Kd, V s/mm. Zero or more.
    pub kd_v_s_per_mm: f64,
    /// tau, the time constant of the derivative's filter, s. Zero or more; zero leaves the derivative unfiltered.
    pub derivative_filter_s: f64,
}

impl PidGains {
    /// True if every gain is finite and within the range its field states.
    pub fn is_valid(&self) -> bool {
        let not_negative = |x: f64| x.is_finite() && x >= 0.0;
        self.kp_v_per_mm.is_finite()
            && self.kp_v_per_mm > 0.0
            && not_negative(self.ki_v_per_mm_s)
            && not_negative(self.kd_v_s_per_mm)
            && not_negative(self.derivative_filter_s)
    }
}

/// The PID ready for the tick.
///
/// ```
/// use quadrant_law::control::pid::{Pid, PidGains};
/// use quadrant_law::control::terms::FeedbackState;
///
/// let gains = PidGains { kp_v_per_mm: 2.0, ki_v_per_mm_s: 10.0, kd_v_s_per_mm: 0.0, derivative_filter_s: 0.0 };
/// let pid = Pid::<f64>::build(&gains, 5.0, 1e-3);
/// let mut state = FeedbackState::default();
/// // An error of 1 mm, and +-10 V to put out: 2 V at once, and 10 mV more in every tick.
/// let first = pid.step(&mut state, 1.0, 0.0, 10.0);
/// let second = pid.step(&mut state, 1.0, 0.0, 10.0);
/// assert_eq!(first.proportional, 2.0);
/// assert!((second.output - first.output - 0.01).abs() < 1e-12);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pid<S: Scalar> {
    pub(super) proportional: S::Gain,
    pub(super) derivative: Derivative<S>,
    pub(super) integrator: Integrator<S>,
}

impl<S: Scalar> Pid<S> {
    /// Makes the PID for a control period. The integral stays within +-`integral_limit_v`; with a limit of zero it is a
    /// PD. Settings time only.
    pub fn build(gains: &PidGains, integral_limit_v: f64, period_s: f64) -> Self {
        Self {
            proportional: S::gain(gains.kp_v_per_mm, Quantity::Length, Quantity::Voltage),
            derivative: Derivative::build(gains.kd_v_s_per_mm, gains.derivative_filter_s, period_s),
            integrator: Integrator::build(
                gains.ki_v_per_mm_s,
                Quantity::Length,
                integral_limit_v,
                period_s,
            ),
        }
    }

    /// Forgets the past: no integral, and no derivative kick at the next step from the present scaled error.
    pub fn reset(&self, state: &mut FeedbackState<S>, error: S) {
        self.derivative.reset(state, error);
    }

    /// Adopts the memory of a PID with other gains, or of one that saw another scaled error: the next step, from
    /// the scaled error given, leaves the derivative as it is.
    pub fn take_over(&self, state: &mut FeedbackState<S>, error: S) {
        self.derivative.take_over(state, error);
    }

    /// One control period. `error` is the scaled error f(e) in mm; output and `base` together stay within
    /// +-`limit`, all in V.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedbackState<S>,
        error: S,
        base: S,
        limit: S,
    ) -> FeedbackTerms<S> {
        let error = self.derivative.clip(error);
        let proportional = error.scale(self.proportional);
        let derivative = self.derivative.step(state, error);
        self.integrator
            .close(state, error, (proportional, derivative), (base, limit))
    }
}
