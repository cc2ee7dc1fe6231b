//! Nominal characteristic trajectory following (NCTF).
//!
//! The *nominal characteristic trajectory* (NCT) is how the axis comes to rest by itself, measured: the speed that it
//! still has at a distance from where it will stop. Control makes the error follow that trajectory into the origin of the
//! phase plane, which asks of the axis only what it does anyway:
//!
//! ```text
//! w = n(e) + de/dt        u = G (w + r int(w))
//! ```
//!
//! n(e) is the NCT, odd in the error. No model is needed. Near the origin n is a straight line, whose slope, G and r
//! decide the linear stability: there the law is a PID with real zeros.
//! Source: Wahyudi, Sato and Shimokohbe, *Characteristics of practical control for point-to-point (PTP) positioning
//! systems*, Precision Engineering 27 (2003).

use heapless::Vec;

use super::surface::{SurfaceGains, SurfaceLoop};
use super::terms::{FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};
use crate::table::OctaveTable;

/// Points of a characteristic at most.
pub const MAX_POINTS: usize = 16;

/// A point of the nominal characteristic trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct CharacteristicPoint {
    /// Distance from where the axis will stop, mm; above zero, rising from point to point, to 30.
    pub error_mm: f64,
    /// The speed that it has there, mm/s; above zero, never falling from point to point, to 1000.
    pub velocity_mm_s: f64,
}

/// The points of a characteristic, one to [`MAX_POINTS`].
pub type Characteristic = Vec<CharacteristicPoint, MAX_POINTS>;

/// NCTF as a person writes it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct NctfGains {
    /// The NCT, joined by straight lines, from the origin on and constant beyond the last point; one to [`MAX_POINTS`].
    pub characteristic: Characteristic,
    /// G, V s/mm; above zero, to 100.
    pub gain_v_s_per_mm: f64,
    /// r, the integral's share, 1/s; 0 to 1e4.
    pub integral_per_s: f64,
}

impl NctfGains {
    /// n(e) for an error of at least zero, mm/s. Settings time and host only.
    pub fn velocity_mm_s(&self, error_mm: f64) -> f64 {
        let mut before = CharacteristicPoint {
            error_mm: 0.0,
            velocity_mm_s: 0.0,
        };
        for point in &self.characteristic {
            if error_mm < point.error_mm {
                let place = (error_mm - before.error_mm) / (point.error_mm - before.error_mm);
                return before.velocity_mm_s + place * (point.velocity_mm_s - before.velocity_mm_s);
            }
            before = *point;
        }
        before.velocity_mm_s
    }

    /// The PI on the phase plane that this is near the origin.
    pub fn surface(&self) -> SurfaceGains {
        let slope = |point: &CharacteristicPoint| point.velocity_mm_s / point.error_mm;
        SurfaceGains {
            slope_per_s: self.characteristic.first().map_or(0.0, slope),
            gain_v_s_per_mm: self.gain_v_s_per_mm,
            integral_per_s: self.integral_per_s,
        }
    }
}

/// NCTF ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Nctf<S: Scalar> {
    characteristic: OctaveTable<S, 1>,
    gain: S::Gain,
    pub(super) inner: SurfaceLoop<S>,
}

impl<S: Scalar> Nctf<S> {
    /// Makes the law for a control period from a characteristic that has at least one point. Settings time only.
    pub fn build(gains: &NctfGains, filter_s: f64, integral_limit_v: f64, period_s: f64) -> Self {
        let end = gains
            .characteristic
            .last()
            .map_or(1.0, |last| last.error_mm);
        Self {
            characteristic: OctaveTable::build(
                end,
                Quantity::Length,
                [Quantity::Velocity],
                |error| [gains.velocity_mm_s(error)],
            ),
            gain: S::gain(gains.gain_v_s_per_mm, Quantity::Velocity, Quantity::Voltage),
            inner: SurfaceLoop::build(&gains.surface(), filter_s, integral_limit_v, period_s),
        }
    }

    /// One control period; output and `base` together stay within +-`limit`, all in V.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedbackState<S>,
        error: S,
        base: S,
        limit: S,
    ) -> FeedbackTerms<S> {
        let error = self.inner.rate.clip(error);
        let [speed] = self.characteristic.at(error.magnitude());
        let velocity = if error < S::ZERO { -speed } else { speed };
        let proportional = velocity.scale(self.gain);
        let derivative = self.inner.rate.step(state, error);
        self.inner
            .close(state, proportional, derivative, (base, limit))
    }
}
