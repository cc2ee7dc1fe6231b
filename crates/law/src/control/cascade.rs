//! Cascade control: a P position loop around a PI velocity loop, the servo drives' usual structure.
//!
//! ```text
//! v_set = sat(Kv e + g v_ref, +-limit)        w = v_set - v
//! u = G (w + r int(w))
//! ```
//!
//! v is the measured velocity, `v_ref - de/dt` with a filtered rate. With full velocity feedforward (g = 1) and within
//! the limit, w is `Kv e + de/dt` and the cascade is a PID with real zeros; with less, the axis lags by
//! `(1 - g) v_ref / Kv`, or until the integral has taken it up. What is its own is the limit on the velocity it asks for:
//! a large error is driven back at that speed, independent of the gains.
//! Source: Gross, Hamann and Wiegärtner, *Electrical Feed Drives in Automation*, Publicis, 2001.

use super::surface::{SurfaceGains, SurfaceLoop};
use super::terms::{FeedbackInput, FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};

/// The cascade as a person writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct CascadeGains {
    /// Kv, the gain of the position loop, 1/s; above zero, to 1e4.
    pub position_gain_per_s: f64,
    /// G, the gain of the velocity loop, V s/mm; above zero, to 100.
    pub velocity_gain_v_s_per_mm: f64,
    /// r, the reciprocal of the velocity loop's reset time, 1/s; 0 to 1e4, 0 for a P/P cascade.
    pub velocity_integral_per_s: f64,
    /// g, the share of the reference's velocity that is fed forward to the velocity loop, 0 to 1.
    pub velocity_feedforward: f64,
    /// Largest velocity that the position loop asks for, mm/s; above zero, to 1000.
    pub velocity_limit_mm_s: f64,
}

impl CascadeGains {
    /// The PI on the phase plane that this is within the limit.
    pub const fn surface(&self) -> SurfaceGains {
        SurfaceGains {
            slope_per_s: self.position_gain_per_s,
            gain_v_s_per_mm: self.velocity_gain_v_s_per_mm,
            integral_per_s: self.velocity_integral_per_s,
        }
    }
}

/// The cascade ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade<S: Scalar> {
    position: S::Gain,
    feedforward: S::Gain,
    limit: S,
    velocity: S::Gain,
    pub(super) inner: SurfaceLoop<S>,
}

impl<S: Scalar> Cascade<S> {
    /// Makes the cascade for a control period. Settings time only.
    pub fn build(
        gains: &CascadeGains,
        filter_s: f64,
        integral_limit_v: f64,
        period_s: f64,
    ) -> Self {
        Self {
            position: S::gain(
                gains.position_gain_per_s,
                Quantity::Length,
                Quantity::Velocity,
            ),
            feedforward: S::gain(
                gains.velocity_feedforward,
                Quantity::Velocity,
                Quantity::Velocity,
            ),
            limit: S::quantise(gains.velocity_limit_mm_s, Quantity::Velocity),
            velocity: S::gain(
                gains.velocity_gain_v_s_per_mm,
                Quantity::Velocity,
                Quantity::Voltage,
            ),
            inner: SurfaceLoop::build(&gains.surface(), filter_s, integral_limit_v, period_s),
        }
    }

    /// One control period; output and `base` together stay within +-`limit`, all in V.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedbackState<S>,
        input: FeedbackInput<S>,
        base: S,
        limit: S,
    ) -> FeedbackTerms<S> {
        let error = self.inner.rate.clip(input.error);
        let requested = error.scale(self.position) + input.velocity.scale(self.feedforward);
        let set = requested.within(self.limit);
        let proportional = (set - input.velocity).scale(self.velocity);
        let derivative = self.inner.rate.step(state, error);
        self.inner
            .close(state, proportional, derivative, (base, limit))
    }
}
