//! Dahl's model: one bristle between surfaces, whose stiffness fades as its force nears the Coulomb level.
//!
//! `dF/dx = sigma0 |w|^delta sgn(w)` with `w = 1 - (F / Fc) sgn(v)`, the distance to the level as a share of it. It has
//! no Stribeck effect, and its memory is one number: a small loop within a larger one does not close.
//! Source: Dahl, *A solid friction model*, Aerospace Corporation TOR-0158(3107-18)-1 (1968); *Solid friction damping of
//! mechanical vibrations*, AIAA Journal 14 (1976).
//!
//! Discretised without an error: over a displacement `dx` in one sense the equation has the solution
//! `w -> w (1 + (delta - 1) z)^(-1 / (delta - 1))`, an exponential `w exp(-z)` for `delta = 1`, with
//! `z = sigma0 |dx| / Fc * w^(delta - 1)`. One table turns `w` into the rate `w^(delta - 1)`, another turns `z` into the
//! share of the distance that is covered, which never exceeds one. Steps beyond `z = 16` count as 16.

use super::bristle::Bristle;
use super::direction::{Direction, PerDirection};
use crate::scalar::{Quantity, Scalar};
use crate::table::OctaveTable;

/// Dahl's model as a person writes it. Its level is the Coulomb level of the static model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct DahlParameters {
    /// sigma0, the stiffness at zero force, V/mm; positive.
    pub stiffness_v_per_mm: f64,
    /// delta, how the stiffness fades: 1 (in proportion to the distance from the level) to 3 (softer).
    pub exponent: f64,
}

/// End of the table of the covered share; 1 - exp(-16) is one to seven digits.
const LARGEST_STEP: f64 = 16.0;

/// Largest `w` that the table of rates resolves: the level of one sense of motion is at most 15 times the other's.
const LARGEST_DISTANCE: f64 = 16.0;

impl DahlParameters {
    /// The share of the distance to the level that is covered in a step `z`, 0..1. Settings time and host only.
    pub fn covered(&self, z: f64) -> f64 {
        let bend = self.exponent - 1.0;
        let exponent = if bend * z > 0.0 {
            libm::log1p(bend * z) / bend
        } else {
            z
        };
        -libm::expm1(-exponent)
    }

    /// The force in V after moving by `displacement_mm` from `force_v` on a surface of the given level, in closed form.
    /// Settings time and host only.
    pub fn force_after_v(&self, force_v: f64, displacement_mm: f64, level_v: f64) -> f64 {
        let target = libm::copysign(level_v, displacement_mm);
        let distance = libm::fabs(1.0 - force_v / target);
        let travel = self.stiffness_v_per_mm * libm::fabs(displacement_mm) / level_v;
        let z = travel * libm::pow(distance, self.exponent - 1.0);
        force_v + (target - force_v) * self.covered(z)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Side<S: Scalar> {
    level: S,
    /// Reciprocal of the level, 1 / Fc.
    per_level: S::Gain,
    /// Stiffness over the level, sigma0 / Fc.
    travel: S::Gain,
}

/// Dahl's model ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Dahl<S: Scalar> {
    sides: PerDirection<Side<S>>,
    rate: OctaveTable<S, 1>,
    covered: OctaveTable<S, 1>,
}

impl<S: Scalar> Dahl<S> {
    /// Makes the model from its parameters and its level in V, positive, for each sense of motion. Settings time only.
    #[inline(never)]
    pub fn build(parameters: &DahlParameters, level_v: PerDirection<f64>) -> Self {
        let (forth, back) = (level_v.positive, level_v.negative);
        let widest = 1.0 + (forth / back).max(back / forth);
        let bend = parameters.exponent - 1.0;
        Self {
            sides: level_v.map(|&level| Side {
                level: S::quantise(level, Quantity::Voltage),
                per_level: S::gain(1.0 / level, Quantity::Voltage, Quantity::Multiplier),
                travel: S::gain(
                    parameters.stiffness_v_per_mm / level,
                    Quantity::Length,
                    Quantity::Multiplier,
                ),
            }),
            rate: OctaveTable::build(
                widest.min(LARGEST_DISTANCE),
                Quantity::Multiplier,
                [Quantity::Multiplier],
                |distance| [libm::pow(distance, bend)],
            ),
            covered: OctaveTable::build(
                LARGEST_STEP,
                Quantity::Multiplier,
                [Quantity::Fraction],
                |z| [parameters.covered(z)],
            ),
        }
    }

    /// The force of a lasting motion, V.
    pub(crate) fn level(&self, direction: Direction) -> S {
        self.sides.of(direction).level
    }

    /// The friction in V after moving by `displacement` (mm); without a displacement nothing changes.
    #[inline(always)]
    pub fn step(&self, state: &mut Bristle<S>, displacement: S) -> S {
        // Neither holds of a displacement that is not a number.
        if displacement > S::ZERO {
            self.advance(state, displacement, Direction::Positive, |f| f);
        } else if displacement < S::ZERO {
            self.advance(state, -displacement, Direction::Negative, |f| -f);
        }
        state.force
    }

    /// `along` turns a force into its component along the motion, and back.
    #[inline(always)]
    fn advance(
        &self,
        state: &mut Bristle<S>,
        distance: S,
        direction: Direction,
        along: impl Fn(S) -> S,
    ) {
        let side = self.sides.of(direction);
        let short = side.level - along(state.force);
        let [rate] = self.rate.at(short.scale(side.per_level).magnitude());
        let z = distance
            .scale(side.travel)
            .times(rate, Quantity::Multiplier);
        let [covered] = self.covered.at(z);
        state.force = state.force + along(short.times(covered, Quantity::Fraction));
    }
}
