//! Sliding friction at constant velocity: the Stribeck curve and the static model.
//!
//! `s(v) = Fc + (Fs - Fc) exp(-|v / Vs|^delta)`, and the static friction model `F = s(v) sgn(v) + sigma v`.
//! Source: Armstrong-Helouvry, Dupont and Canudas de Wit, *A survey of models, analysis tools and compensation
//! methods for the control of machines with friction*, Automatica 30 (1994).

use super::direction::{Direction, PerDirection};
use crate::scalar::{Quantity, Scalar};
use crate::table::{OctaveTable, interpolation_error};

/// The Stribeck curve of one sense of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct StribeckCurve {
    /// Fc, the level at high velocity, V.
    pub coulomb_v: f64,
    /// Fs, the level at breakaway, V; below Fc where the level rises with the velocity.
    pub breakaway_v: f64,
    /// Vs, the velocity scale of the change from Fs to Fc, mm/s.
    pub stribeck_velocity_mm_s: f64,
    /// delta, the shape of the change; 1 is exponential, 2 Gaussian.
    pub exponent: f64,
}

impl StribeckCurve {
    /// s(v) in V at a velocity in mm/s, by the formula. Settings time and host only.
    pub fn level_v(&self, velocity_mm_s: f64) -> f64 {
        let ratio = libm::fabs(velocity_mm_s) / self.stribeck_velocity_mm_s;
        let drop = libm::exp(-libm::pow(ratio, self.exponent));
        self.coulomb_v + (self.breakaway_v - self.coulomb_v) * drop
    }

    /// The velocity in mm/s from which s(v) is Fc to within 0.02 % of Fs.
    pub fn flat_velocity_mm_s(&self) -> f64 {
        let drop = 2e-4 * self.breakaway_v / libm::fabs(self.breakaway_v - self.coulomb_v);
        // A curve without a drop still needs a table with an end.
        let depth = if drop < 1.0 { -libm::log(drop) } else { 1.0 };
        self.stribeck_velocity_mm_s * libm::pow(depth, 1.0 / self.exponent)
    }

    /// The largest difference between s(v) and its table, V.
    pub fn table_error_v(&self) -> f64 {
        interpolation_error(self.flat_velocity_mm_s(), f64::MAX, |v| self.level_v(v))
    }
}

/// The static friction model of one sense of motion.
///
/// ```
/// use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
///
/// let curve = StribeckCurve { coulomb_v: 0.1, breakaway_v: 0.15, stribeck_velocity_mm_s: 2.0, exponent: 1.0 };
/// let friction = StaticFriction { curve, viscous_v_s_per_mm: 1e-3 };
/// // Just moving, the breakaway level; fast, the Coulomb level and viscous friction.
/// assert!((friction.friction_v(1e-6) - 0.15).abs() < 1e-6);
/// assert!((friction.friction_v(100.0) - 0.2).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct StaticFriction {
    /// The Stribeck curve, s(v).
    pub curve: StribeckCurve,
    /// sigma, viscous friction, V s/mm; zero or more.
    pub viscous_v_s_per_mm: f64,
}

impl StaticFriction {
    /// F in V at a velocity in mm/s of this sense of motion, by the formula; zero at rest. Settings time and host only.
    pub fn friction_v(&self, velocity_mm_s: f64) -> f64 {
        let sign = if velocity_mm_s > 0.0 {
            1.0
        } else if velocity_mm_s < 0.0 {
            -1.0
        } else {
            0.0
        };
        sign * self.curve.level_v(velocity_mm_s) + self.viscous_v_s_per_mm * velocity_mm_s
    }
}

/// The sliding surface at one velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sliding<S> {
    /// Level of the surface, s(v), V.
    pub level: S,
    /// exp(-C Ts / s(v)): what is left, after one step, of a slipping element's distance from its share of s(v).
    pub decay: S,
}

/// s(v) and the decay that goes with it, for both senses of motion, ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct SlidingTable<S: Scalar> {
    tables: PerDirection<OctaveTable<S, 2>>,
}

impl<S: Scalar> SlidingTable<S> {
    /// Tabulates the curves. `attraction_v_s` is C, in V/s; `step_s` the time between evaluations. Settings time only.
    pub fn build(curves: &PerDirection<StribeckCurve>, attraction_v_s: f64, step_s: f64) -> Self {
        let mut table = Self::blank();
        table.fill(curves, attraction_v_s, step_s);
        table
    }

    /// Zeros, to be [filled](Self::fill).
    pub(crate) fn blank() -> Self {
        Self {
            tables: PerDirection {
                positive: OctaveTable::blank(),
                negative: OctaveTable::blank(),
            },
        }
    }

    /// As [`build`](Self::build), in place.
    pub(crate) fn fill(
        &mut self,
        curves: &PerDirection<StribeckCurve>,
        attraction_v_s: f64,
        step_s: f64,
    ) {
        for direction in [Direction::Positive, Direction::Negative] {
            let curve = curves.of(direction);
            self.tables.of_mut(direction).fill(
                curve.flat_velocity_mm_s(),
                Quantity::Velocity,
                [Quantity::Voltage, Quantity::Fraction],
                &|velocity| {
                    let level = curve.level_v(velocity);
                    [level, decay(attraction_v_s, step_s, level)]
                },
            );
        }
    }

    /// The surface at a speed (a non-negative velocity).
    pub fn at(&self, speed: S, direction: Direction) -> Sliding<S> {
        let [level, decay] = self.tables.of(direction).at(speed);
        Sliding { level, decay }
    }
}

/// exp(-C Ts / s).
fn decay(attraction_v_s: f64, step_s: f64, level_v: f64) -> f64 {
    libm::exp(-attraction_v_s * step_s / level_v)
}

impl<S: Scalar> Sliding<S> {
    /// The force of an element that slips, one step after `force`: it nears its share of the level. `along` turns a force into
    /// its component along the motion, and back.
    pub(super) fn slip(&self, force: S, share: S, along: impl Fn(S) -> S) -> S {
        along(share + (along(force) - share).times(self.decay, Quantity::Fraction))
    }

    /// A surface whose level does not depend on velocity: the one that GMS alone slides on.
    pub fn constant(level_v: f64, attraction_v_s: f64, step_s: f64) -> Self {
        Self {
            level: S::quantise(level_v, Quantity::Voltage),
            decay: S::quantise(decay(attraction_v_s, step_s, level_v), Quantity::Fraction),
        }
    }
}
