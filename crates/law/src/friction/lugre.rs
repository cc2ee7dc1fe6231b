//! The LuGre model: bristles that bend with the motion, on a surface with a Stribeck effect.
//!
//! `dz/dt = v - sigma0 |v| z / s(v)`, `F = sigma0 z + sigma1 dz/dt + sigma2 v`; sigma2 is the viscous friction of the
//! static model and is added there. Its memory is one number, and it drifts under a vibrating load.
//! Source: Canudas de Wit, Olsson, Astrom and Lischinsky, *A new model for control of systems with friction*, IEEE
//! Transactions on Automatic Control 40 (1995); passivity needs `sigma1 <= sigma2 Fc / (Fs - Fc)` (Barabanov and Ortega,
//! *Necessary and sufficient conditions for passivity of the LuGre friction model*, the same 45, 2000).
//!
//! Discretised by the exact step at the velocity of the tick: `sigma0 z` covers the share `1 - exp(-sigma0 |v| Ts / s(v))`
//! of its distance to `s(v) sgn(v)`. The share depends on the velocity alone, so it stands beside s(v) in the table; the
//! share itself, not what is left, since near rest it is far below the resolution of numbers near one. The table reaches to
//! where little is left to cover, unless the Stribeck curve needs its nodes near zero; beyond its end both stay as they
//! are there.

use super::bristle::Bristle;
use super::direction::{Direction, PerDirection};
use super::stribeck::StribeckCurve;
use crate::scalar::{Quantity, Scalar};
use crate::table::{OctaveTable, interpolation_error};
use crate::units::FASTEST_MM_S;

/// The LuGre model as a person writes it. Its surface is the static model's Stribeck curve.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct LugreParameters {
    /// sigma0, the stiffness of the bristles, V/mm; positive.
    pub stiffness_v_per_mm: f64,
    /// sigma1, the damping of their bending, V s/mm; 0 to 1.
    pub damping_v_s_per_mm: f64,
}

/// Step of the bristles, sigma0 |v| Ts / Fc, up to which the table reaches: exp(-4) is left there, or exp(-8).
const LARGEST_STEP: f64 = 8.0;
/// Largest error of the tabulated s(v) over Fs for the sake of a longer table.
const TABLE_TOLERANCE: f64 = 2.5e-4;

/// The velocity at which the tables end, mm/s.
fn table_end_mm_s(curve: &StribeckCurve, stiffness_v_per_mm: f64, step_s: f64) -> f64 {
    let needed = LARGEST_STEP * curve.coulomb_v / (stiffness_v_per_mm * step_s);
    let needed = needed.min(FASTEST_MM_S);
    let tolerance_v = TABLE_TOLERANCE * curve.breakaway_v;
    let mut end = curve.flat_velocity_mm_s();
    // Doublings from a thousandth of a mm/s, the smallest Vs, to the fastest motion are twenty.
    for _ in 0..20 {
        let longer = 2.0 * end;
        if longer > needed
            || interpolation_error(longer, f64::MAX, |v| curve.level_v(v)) > tolerance_v
        {
            break;
        }
        end = longer;
    }
    end
}

/// The LuGre model ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Lugre<S: Scalar> {
    /// s(v), and the share of the distance to it that is covered in a step.
    tables: PerDirection<OctaveTable<S, 2>>,
    /// sigma1 / (sigma0 Ts).
    damping: S::Gain,
}

impl<S: Scalar> Lugre<S> {
    /// Makes the model; `step_s` is the time between evaluations. Settings time only.
    pub fn build(
        parameters: &LugreParameters,
        curves: &PerDirection<StribeckCurve>,
        step_s: f64,
    ) -> Self {
        let mut model = Self::blank();
        model.fill(parameters, curves, step_s);
        model
    }

    /// A model that puts out nothing, to be [filled](Self::fill).
    pub(crate) fn blank() -> Self {
        Self {
            tables: PerDirection {
                positive: OctaveTable::blank(),
                negative: OctaveTable::blank(),
            },
            damping: S::Gain::default(),
        }
    }

    /// As [`build`](Self::build), in place.
    pub(crate) fn fill(
        &mut self,
        parameters: &LugreParameters,
        curves: &PerDirection<StribeckCurve>,
        step_s: f64,
    ) {
        let stiffness = parameters.stiffness_v_per_mm;
        for direction in [Direction::Positive, Direction::Negative] {
            let curve = curves.of(direction);
            self.tables.of_mut(direction).fill(
                table_end_mm_s(curve, stiffness, step_s),
                Quantity::Velocity,
                [Quantity::Voltage, Quantity::Fraction],
                &|velocity| {
                    let level = curve.level_v(velocity);
                    [level, -libm::expm1(-stiffness * velocity * step_s / level)]
                },
            );
        }
        self.damping = S::gain(
            parameters.damping_v_s_per_mm / (stiffness * step_s),
            Quantity::Voltage,
            Quantity::Voltage,
        );
    }

    /// The force of a lasting motion, V, but for the viscous friction.
    pub(crate) fn level(&self, speed: S, direction: Direction) -> S {
        let [level, _] = self.tables.of(direction).at(speed);
        level
    }

    /// `sigma0 z + sigma1 dz/dt` in V after a step at `speed` (mm/s, not negative) in the sense of `displacement` (mm);
    /// without a displacement nothing changes.
    #[inline(always)]
    pub fn step(&self, state: &mut Bristle<S>, displacement: S, speed: S) -> S {
        // Neither holds of a displacement that is not a number.
        let (direction, forth) = if displacement > S::ZERO {
            (Direction::Positive, true)
        } else if displacement < S::ZERO {
            (Direction::Negative, false)
        } else {
            return state.force;
        };
        let [level, covered] = self.tables.of(direction).at(speed);
        let target = if forth { level } else { -level };
        let change = (target - state.force).times(covered, Quantity::Fraction);
        state.force = state.force + change;
        state.force + change.scale(self.damping)
    }
}
