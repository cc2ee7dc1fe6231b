//! The smoothed generalized Maxwell-slip model (S-GMS): the GMS with a gradual transition from sticking to slipping.
//!
//! An element's force depends on the gap to its share, `g = alpha_i s(v) - F_i sgn(v)`, through a switch that falls from
//! one to zero over the width `W_i`, a share of the element's breakaway level: `S(g) = min(max(g / W_i, 0), 1)` and
//! `dF_i/dt = S k_i v + (1 - S) sgn(v) C (alpha_i - |F_i| / s(v))`, but never faster towards the share than its spring, `k_i v`:
//! in slow motion attraction would else make the element stiffer than it is, and give back more than it took. Nothing but
//! the forces is remembered, so the force is a continuously differentiable function of the displacement between two
//! reversals. Without GMS's memory of having slipped, an element whose share rises takes part of the spring's force again.
//! Source: the idea is Boegli, De Laet, De Schutter and Swevers', *A smoothed GMS friction model suited for gradient-based
//! friction state and parameter estimation*, IEEE/ASME Transactions on Mechatronics 19 (2014). The switch is ours: theirs
//! has no closed solution.
//!
//! Discretised by the exact step of each part, the spring's first: the gap shrinks by `k_i |dx|` down to the width, and
//! from there by `exp(-k_i |dx| / W_i)`. A switch of higher order, such as a cubic, would bring the force near its share
//! only as `1 / x`. The exponential is `((1 + (1 - h)^2) / 2)^8` with `h` an eighth of its argument, at most one: 0.005 off at
//! most, and never negative.

use super::direction::Direction;
use super::gms::{GmsElement, GmsState};
use super::stribeck::Sliding;
use crate::scalar::{Quantity, Scalar};

/// Parameters of the S-GMS beyond those of the GMS, as a person writes them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct SmoothedGmsParameters {
    /// Width of the transition over each element's breakaway level, 0.001 to 1. The GMS is the limit of zero.
    pub width: f64,
}

impl SmoothedGmsParameters {
    /// The defaults of the settings.
    pub const DEFAULT: Self = Self { width: 0.25 };
}

impl Default for SmoothedGmsParameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ElementConfig<S: Scalar> {
    stiffness: S::Gain,
    weight: S::Gain,
    /// Saturation of the element, W_i, V.
    width: S,
    /// Reciprocal of the saturation, 1 / W_i.
    per_width: S::Gain,
    /// 1 / (8 W_i).
    per_eight_widths: S::Gain,
}

/// The S-GMS ready for the tick. `N` is the room for elements; those not used do not act.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothedGms<S: Scalar, const N: usize> {
    elements: [ElementConfig<S>; N],
    one: S,
    half: S::Gain,
}

impl<S: Scalar, const N: usize> SmoothedGms<S, N> {
    /// Makes the model from the GMS's elements, at most `N` of them; any beyond are left out, so settings are checked
    /// against `N` before they come here. `breakaway_v` is the level that widths are shares of. Settings time only.
    pub fn build(
        elements: &[GmsElement],
        parameters: &SmoothedGmsParameters,
        breakaway_v: f64,
    ) -> Self {
        Self {
            elements: core::array::from_fn(|index| {
                // An absent element has no weight and no stiffness: its gap is always zero.
                let (stiffness, weight) = elements
                    .get(index)
                    .map_or((0.0, 0.0), |e| (e.stiffness_v_per_mm, e.weight));
                let width = parameters.width * weight * breakaway_v;
                let per_width = if width > 0.0 { 1.0 / width } else { 0.0 };
                let inverse = |value| S::gain(value, Quantity::Voltage, Quantity::Fraction);
                ElementConfig {
                    stiffness: S::gain(stiffness, Quantity::Length, Quantity::Voltage),
                    weight: S::gain(weight, Quantity::Voltage, Quantity::Voltage),
                    width: S::quantise(width, Quantity::Voltage),
                    per_width: inverse(per_width),
                    per_eight_widths: inverse(per_width / 8.0),
                }
            }),
            one: S::quantise(1.0, Quantity::Fraction),
            half: S::gain(0.5, Quantity::Fraction, Quantity::Fraction),
        }
    }

    /// The forces of the elements, V.
    pub fn forces(&self, state: &GmsState<S, N>) -> [S; N] {
        state.forces_by(self.weights())
    }

    /// Lets the elements carry `change` more, V, by their weights.
    pub(crate) fn load(&self, state: &mut GmsState<S, N>, change: S) {
        state.load(change, self.weights());
    }

    fn weights(&self) -> impl Iterator<Item = S::Gain> + Clone {
        self.elements.iter().map(|element| element.weight)
    }

    /// The friction in V after moving by `displacement` (mm) over the surface `sliding`; without a displacement
    /// nothing changes.
    #[inline(always)]
    pub fn step(&self, state: &mut GmsState<S, N>, displacement: S, sliding: Sliding<S>) -> S {
        // Neither holds of a displacement that is not a number.
        if displacement > S::ZERO {
            state.stick(Direction::Positive, self.weights());
            self.advance(state, displacement, sliding, |f| f);
        } else if displacement < S::ZERO {
            state.stick(Direction::Negative, self.weights());
            self.advance(state, -displacement, sliding, |f| -f);
        }
        state.total()
    }

    /// `along` turns a force into its component along the motion, and back.
    #[inline(always)]
    fn advance(
        &self,
        state: &mut GmsState<S, N>,
        distance: S,
        sliding: Sliding<S>,
        along: impl Fn(S) -> S,
    ) {
        let fading = self.one - sliding.decay;
        for (element, force) in self.elements.iter().zip(&mut state.forces) {
            let share = sliding.level.scale(element.weight);
            let gap = share - along(*force);
            let push = distance.scale(element.stiffness);
            let beyond = gap - element.width;
            let least = gap - push;
            let free = if beyond > S::ZERO { beyond } else { S::ZERO };
            let used = if push < free { push } else { free };
            let mut gap = gap - used;
            if gap > S::ZERO {
                let left = self.exponential((push - used).scale(element.per_eight_widths));
                gap = gap.times(left, Quantity::Fraction);
            }
            let sticking = gap.scale(element.per_width).limit(S::ZERO, self.one);
            let slipped = gap
                .times(self.one - sticking, Quantity::Fraction)
                .times(fading, Quantity::Fraction);
            let next = gap - slipped;
            let next = if next < least { least } else { next };
            *force = along(share - next);
        }
    }

    /// exp(-8 h) for an `h` of zero or more.
    #[inline(always)]
    fn exponential(&self, h: S) -> S {
        let rest = self.one - h.limit(S::ZERO, self.one);
        let root = (self.one + rest.times(rest, Quantity::Fraction)).scale(self.half);
        let square = root.times(root, Quantity::Fraction);
        let fourth = square.times(square, Quantity::Fraction);
        fourth.times(fourth, Quantity::Fraction)
    }
}
