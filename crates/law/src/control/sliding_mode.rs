//! Sliding mode control with a boundary layer.
//!
//! ```text
//! w = lambda e + de/dt        u = K sat(w / phi) + r int(K sat(w / phi))
//! ```
//!
//! Beyond the boundary layer, `|w| > phi`, the output is the full K, which holds any disturbance below K; within
//! it the law is a PI on w with the gain K / phi, a PID with real zeros. A thin layer is precise and chatters: encoder
//! noise and the dead time of the plant decide how thin it may be. The integral, if any, acts on the saturated surface,
//! so that it cannot wind up on a large error.
//! Source: Slotine and Li, *Applied Nonlinear Control*, Prentice Hall, 1991, chapter 7.

use super::surface::{SurfaceGains, SurfaceLoop};
use super::terms::{FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};

/// Sliding mode as a person writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct SlidingModeGains {
    /// lambda, the slope of the sliding line, 1/s: on it the error falls as exp(-lambda t). Above zero, to 1e4.
    pub slope_per_s: f64,
    /// K, the switching output, V; above zero, at most the output limit.
    pub switching_v: f64,
    /// phi, half the thickness of the boundary layer, mm/s; above zero, to 1000.
    pub boundary_mm_s: f64,
    /// r, the integral's share, 1/s; 0 to 1e4.
    pub integral_per_s: f64,
}

impl SlidingModeGains {
    /// The PI on the phase plane that this is within the boundary layer.
    pub const fn surface(&self) -> SurfaceGains {
        SurfaceGains {
            slope_per_s: self.slope_per_s,
            gain_v_s_per_mm: self.switching_v / self.boundary_mm_s,
            integral_per_s: self.integral_per_s,
        }
    }
}

/// Sliding mode ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct SlidingMode<S: Scalar> {
    line: S::Gain,
    switching: S,
    pub(super) inner: SurfaceLoop<S>,
}

impl<S: Scalar> SlidingMode<S> {
    /// Makes the law for a control period. Settings time only.
    pub fn build(
        gains: &SlidingModeGains,
        filter_s: f64,
        integral_limit_v: f64,
        period_s: f64,
    ) -> Self {
        let surface = gains.surface();
        Self {
            line: S::gain(
                surface.slope_per_s * surface.gain_v_s_per_mm,
                Quantity::Length,
                Quantity::Voltage,
            ),
            switching: S::quantise(gains.switching_v, Quantity::Voltage),
            inner: SurfaceLoop::build(&surface, filter_s, integral_limit_v, period_s),
        }
    }

    /// One control period; output and `base` together stay within +-`limit`, all in V. The saturated surface
    /// is reported as the proportional term.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedbackState<S>,
        error: S,
        base: S,
        limit: S,
    ) -> FeedbackTerms<S> {
        let error = self.inner.rate.clip(error);
        let distance = error.scale(self.line) + self.inner.rate.step(state, error);
        let switching = distance.within(self.switching);
        self.inner.close(state, switching, S::ZERO, (base, limit))
    }
}
