//! The common part of cascade control, sliding mode and NCTF, and their equivalence with a PID.
//!
//! All three form a velocity-like error `w = h(e) + de/dt`, the distance from a curve in the phase plane, and put a PI
//! on it: `u = G (w + r int(w))`. With `h(e) = lambda e`, and `int(de/dt) = e`, that is a PID with
//!
//! ```text
//! Kp = G (lambda + r)      Ki = G lambda r      Kd = G (1 - r tau)
//! ```
//!
//! whose zeros are real: `-lambda` and `-r`. tau is the filter of the error's rate. So a robustness that is asked of one
//! law can be asked of all.

use super::derivative::Derivative;
use super::integrator::Integrator;
use super::pid::PidGains;
use super::terms::{FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};

/// A PI on `w = lambda e + de/dt`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceGains {
    /// lambda, the slope of the curve at zero error, 1/s. Above zero.
    pub slope_per_s: f64,
    /// G, V s/mm. Above zero.
    pub gain_v_s_per_mm: f64,
    /// r, the integral's share, 1/s; zero for a P.
    pub integral_per_s: f64,
}

impl SurfaceGains {
    /// The PID that these gains are, with a rate filtered by `filter_s`.
    pub fn to_pid(self, filter_s: f64) -> PidGains {
        let (slope, gain, integral) = (self.slope_per_s, self.gain_v_s_per_mm, self.integral_per_s);
        PidGains {
            kp_v_per_mm: gain * (slope + integral),
            ki_v_per_mm_s: gain * slope * integral,
            kd_v_s_per_mm: gain * (1.0 - integral * filter_s),
            derivative_filter_s: filter_s,
        }
    }

    /// The gains whose PID this is, the larger zero taken for the slope; nothing when its zeros are complex or it has no
    /// derivative.
    pub fn from_pid(pid: &PidGains) -> Option<Self> {
        // G from Kd = G - Ki tau / lambda' is implicit in r; with the small tau of a filter a few rounds settle it.
        let mut gains = Self {
            slope_per_s: 0.0,
            gain_v_s_per_mm: pid.kd_v_s_per_mm,
            integral_per_s: 0.0,
        };
        for _ in 0..20 {
            let half = 0.5 * pid.kp_v_per_mm / gains.gain_v_s_per_mm;
            let root = half * half - pid.ki_v_per_mm_s / gains.gain_v_s_per_mm;
            let real = gains.gain_v_s_per_mm > 0.0 && root >= 0.0;
            if !real {
                return None;
            }
            gains.slope_per_s = half + libm::sqrt(root);
            gains.integral_per_s = pid.ki_v_per_mm_s / gains.gain_v_s_per_mm / gains.slope_per_s;
            gains.gain_v_s_per_mm =
                pid.kd_v_s_per_mm / (1.0 - gains.integral_per_s * pid.derivative_filter_s);
        }
        gains.is_valid().then_some(gains)
    }

    /// True if every gain is finite and within the range its field states.
    fn is_valid(&self) -> bool {
        let finite = self.slope_per_s.is_finite() && self.gain_v_s_per_mm.is_finite();
        finite && self.slope_per_s > 0.0 && self.gain_v_s_per_mm > 0.0 && self.integral_per_s >= 0.0
    }
}

/// The PI ready for the tick, in volts: `G h(e)` is given, `G de/dt` is its own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SurfaceLoop<S: Scalar> {
    pub(super) rate: Derivative<S>,
    integrator: Integrator<S>,
}

impl<S: Scalar> SurfaceLoop<S> {
    /// Makes the PI for a control period. Settings time only.
    pub(super) fn build(
        gains: &SurfaceGains,
        filter_s: f64,
        integral_limit_v: f64,
        period_s: f64,
    ) -> Self {
        let limit = if gains.integral_per_s > 0.0 {
            integral_limit_v
        } else {
            0.0
        };
        Self {
            rate: Derivative::build(gains.gain_v_s_per_mm, filter_s, period_s),
            integrator: Integrator::build(gains.integral_per_s, Quantity::Voltage, limit, period_s),
        }
    }

    /// Closes with `proportional` and `derivative`, whose sum drives the integral.
    pub(super) fn close(
        &self,
        state: &mut FeedbackState<S>,
        proportional: S,
        derivative: S,
        bounds: (S, S),
    ) -> FeedbackTerms<S> {
        let driver = proportional + derivative;
        self.integrator
            .close(state, driver, (proportional, derivative), bounds)
    }
}
