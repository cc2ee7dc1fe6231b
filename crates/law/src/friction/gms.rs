//! The generalized Maxwell-slip (GMS) model: friction before and during sliding, with memory.
//!
//! `N` massless blocks in parallel, each on its own spring, share the load by weights that sum to one. A block sticks,
//! `dF_i/dt = k_i v`, until its force reaches its share `alpha_i s(v)` of the sliding surface; then it slips,
//! `dF_i/dt = sgn(v) C (alpha_i - |F_i| / s(v))`, until the velocity reverses.
//! Source: Lampaert, Al-Bender and Swevers, *A generalized Maxwell-slip friction model appropriate for control
//! purposes*, IEEE PhysCon 2003.
//!
//! A block slips from the force that it carries: a surface that has fallen below it while it stuck takes the force down by
//! the slip equation, not in one step.
//!
//! Discretised by the exact step of each branch: sticking by the displacement, slipping by the exponential. An
//! explicit step of the slip equation overshoots when `C Ts / s` is not small. Blocks that all slip obey one equation, which
//! is linear in the forces over the shares: their sum takes one step, and how far each is from its share of the sum shrinks by
//! the same factor for all.

use heapless::Vec;

use super::bristle::Bristle;
use super::direction::Direction;
use super::stribeck::Sliding;
use crate::scalar::{Quantity, Scalar};

/// Elements in a settings file at most.
pub const MAX_ELEMENTS: usize = 10;

/// Elements that the firmware has room for: with eight, identification and not their number decides the accuracy.
pub const FIRMWARE_ELEMENTS: usize = 8;

/// One block of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct GmsElement {
    /// k_i, the spring of the block, V/mm; positive.
    pub stiffness_v_per_mm: f64,
    /// alpha_i, its share of the load, 0..=1; the shares of all blocks sum to one.
    pub weight: f64,
}

/// The blocks of a model, one to [`MAX_ELEMENTS`].
pub type GmsElements = Vec<GmsElement, MAX_ELEMENTS>;

/// The GMS model as a person writes it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct GmsParameters {
    /// The blocks, one to [`MAX_ELEMENTS`].
    pub elements: GmsElements,
    /// C, the rate at which sliding friction follows the Stribeck effect, V/s.
    pub attraction_v_s: f64,
}

impl GmsParameters {
    /// Blocks of a stiffness in V/mm and a share of the load each, and the attraction in V/s.
    pub fn new<const COUNT: usize>(blocks: [(f64, f64); COUNT], attraction_v_s: f64) -> Self {
        Self {
            elements: Vec::from_array(blocks.map(|(stiffness_v_per_mm, weight)| GmsElement {
                stiffness_v_per_mm,
                weight,
            })),
            attraction_v_s,
        }
    }

    /// The force in V at a displacement in mm from rest on a surface of constant level: the virgin curve
    /// `sum(min(k_i x, alpha_i s))`, odd in the displacement. Settings time and host only.
    pub fn virgin_curve_v(&self, displacement_mm: f64, level_v: f64) -> f64 {
        let distance = libm::fabs(displacement_mm);
        let force: f64 = self
            .elements
            .iter()
            .map(|element| (element.stiffness_v_per_mm * distance).min(element.weight * level_v))
            .sum();
        libm::copysign(force, displacement_mm)
    }

    /// The stiffness of all springs together, V/mm: that of the virgin curve at rest. Settings time and host only.
    pub fn stiffness_v_per_mm(&self) -> f64 {
        let springs = self.elements.iter();
        springs.map(|element| element.stiffness_v_per_mm).sum()
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ElementConfig<S: Scalar> {
    stiffness: S::Gain,
    weight: S::Gain,
}

/// The GMS model ready for the tick.
///
/// ```
/// use quadrant_law::friction::gms::{Gms, GmsElement, GmsState};
/// use quadrant_law::friction::stribeck::Sliding;
///
/// let elements = [(100.0, 0.5), (20.0, 0.5)]
///     .map(|(stiffness_v_per_mm, weight)| GmsElement { stiffness_v_per_mm, weight });
/// let model = Gms::<f64, 8>::build(&elements);
/// let surface = Sliding::constant(0.2, 10.0, 1e-4); // 0.2 V
/// let mut state = GmsState::default();
/// // Before it slides, friction is a spring: 120 V/mm over the first half micrometre.
/// assert!((model.step(&mut state, 0.5e-3, surface) - 0.06).abs() < 1e-12);
/// // After a millimetre it has the level of the surface.
/// assert!((model.step(&mut state, 1.0, surface) - 0.2).abs() < 1e-12);
/// ```
/// `N` is the room for elements; those not used do not act.
#[derive(Clone, Debug, PartialEq)]
pub struct Gms<S: Scalar, const N: usize> {
    elements: [ElementConfig<S>; N],
    one: S,
}

/// The memory of the GMS model.
#[derive(Clone, Debug, PartialEq)]
pub struct GmsState<S: Scalar, const N: usize> {
    /// The elements' forces, V; while all slip, how far each was from its share of their sum when the last began to.
    pub(super) forces: [S; N],
    /// The sum of the forces while all slip, V; of bristles, their force.
    sum: S,
    /// Share that is left of the distances in `forces` while all slip, a [`Quantity::Fraction`].
    left: S,
    /// A bit for each element that slips, and [`BACKWARD`] after a motion towards smaller positions: one comparison shows that
    /// all go on slipping. [`BRISTLES`] after a model of bristles: their force is to be spread.
    slipping: u32,
}

/// Bit above those of the elements.
const BACKWARD: u32 = 1 << 31;

/// Bit that a model of bristles leaves, with those of all elements.
const BRISTLES: u32 = 1 << 30;

impl Direction {
    /// Its bit in [`GmsState::slipping`].
    const fn bit(self) -> u32 {
        match self {
            Self::Positive => 0,
            Self::Negative => BACKWARD,
        }
    }
}

impl<S: Scalar, const N: usize> Default for GmsState<S, N> {
    /// All springs slack: the virgin state.
    fn default() -> Self {
        Self {
            forces: [S::ZERO; N],
            sum: S::ZERO,
            left: S::ZERO,
            slipping: Direction::Positive.bit(),
        }
    }
}

impl<S: Scalar, const N: usize> GmsState<S, N> {
    /// The bits of all elements.
    const ALL: u32 = {
        assert!(N < 30);
        (1 << N) - 1
    };

    /// True if every element slips.
    fn all_slip(&self) -> bool {
        self.slipping & Self::ALL == Self::ALL
    }

    /// The forces of the elements, V.
    pub(super) fn forces_by(&self, weights: impl Iterator<Item = S::Gain>) -> [S; N] {
        let mut stuck = self.clone();
        stuck.stick(Direction::Positive, weights);
        stuck.forces
    }

    /// The friction, the sum of the elements' forces, V.
    #[inline(always)]
    pub fn total(&self) -> S {
        if self.all_slip() {
            return self.sum;
        }
        let mut force = S::ZERO;
        for element in self.forces {
            force = force + element;
        }
        force
    }

    /// Lets every element slip on from its share of `sum`, V.
    pub(crate) fn slide(&mut self, sum: S, direction: Direction) {
        self.sum = sum;
        self.left = S::ZERO;
        self.slipping = Self::ALL | direction.bit();
    }

    /// Lets a model of bristles act on the force. Elements that act after it stick, and carry its force by their weights.
    pub(crate) fn as_bristles<R>(&mut self, act: impl FnOnce(&mut Bristle<S>) -> R) -> R {
        let mut bristles = Bristle::bent(self.total());
        let result = act(&mut bristles);
        self.sum = bristles.force();
        // As if all slipped and nothing were left of their distances.
        self.left = S::ZERO;
        self.slipping = Self::ALL | BRISTLES;
        result
    }

    /// Goes on with the sum of the elements, which all slip from now on; `one` is all of their distances.
    #[inline(always)]
    fn join(&mut self, sum: S, one: S, weights: impl Iterator<Item = S::Gain>) {
        self.sum = sum;
        self.left = one;
        for (force, weight) in self.forces.iter_mut().zip(weights) {
            *force = *force - sum.scale(weight);
        }
    }

    /// Lets the elements carry `change` more, V, by their weights; they stick.
    pub(super) fn load(&mut self, change: S, weights: impl Iterator<Item = S::Gain> + Clone) {
        let backward = self.slipping & BACKWARD;
        self.stick(Direction::Positive, weights.clone());
        self.slipping = backward;
        for (force, weight) in self.forces.iter_mut().zip(weights) {
            *force = *force + change.scale(weight);
        }
    }

    /// Lets every element stick, as a reversal does, or as a model asks for that does not remember which ones slip.
    #[inline(always)]
    pub(super) fn stick(&mut self, direction: Direction, weights: impl Iterator<Item = S::Gain>) {
        if self.all_slip() {
            for (force, weight) in self.forces.iter_mut().zip(weights) {
                *force = self.sum.scale(weight) + force.times(self.left, Quantity::Fraction);
            }
        }
        self.slipping = direction.bit();
    }
}

impl<S: Scalar, const N: usize> Gms<S, N> {
    /// Makes the model from its elements, at most `N` of them; any beyond are left out, so settings are checked
    /// against `N` before they come here. Settings time only.
    pub fn build(elements: &[GmsElement]) -> Self {
        Self {
            elements: core::array::from_fn(|index| {
                // An absent element has no weight: it slips at zero force.
                let (stiffness, weight) = elements
                    .get(index)
                    .map_or((0.0, 0.0), |e| (e.stiffness_v_per_mm, e.weight));
                ElementConfig {
                    stiffness: S::gain(stiffness, Quantity::Length, Quantity::Voltage),
                    weight: S::gain(weight, Quantity::Voltage, Quantity::Voltage),
                }
            }),
            one: S::quantise(1.0, Quantity::Fraction),
        }
    }

    /// The forces of the elements, V.
    pub fn forces(&self, state: &GmsState<S, N>) -> [S; N] {
        state.forces_by(self.weights())
    }

    /// Lets the elements carry `change` more, V, by their weights; they stick.
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
        if displacement > S::ZERO {
            self.advance(state, displacement, sliding, Direction::Positive, |f| f)
        } else if displacement < S::ZERO {
            self.advance(state, displacement, sliding, Direction::Negative, |f| -f)
        } else {
            state.total()
        }
    }

    /// `along` turns a force into its component along the motion, and back.
    #[inline(always)]
    fn advance(
        &self,
        state: &mut GmsState<S, N>,
        displacement: S,
        sliding: Sliding<S>,
        direction: Direction,
        along: impl Fn(S) -> S,
    ) -> S {
        if state.slipping == GmsState::<S, N>::ALL | direction.bit() {
            state.sum = sliding.slip(state.sum, sliding.level, &along);
            state.left = state.left.times(sliding.decay, Quantity::Fraction);
            return state.sum;
        }
        if state.slipping & (BACKWARD | BRISTLES) != direction.bit() {
            state.stick(direction, self.weights());
        }
        let mut slipping = state.slipping;
        let mut total = S::ZERO;
        let elements = self.elements.iter().zip(&mut state.forces);
        for ((element, force), bit) in elements.zip((0..N).map(|index| 1 << index)) {
            let share = sliding.level.scale(element.weight);
            let slips = slipping & bit != 0;
            let trial = *force + displacement.scale(element.stiffness);
            // Neither holds of what is not a number.
            *force = if !slips && along(trial) < share {
                trial
            } else {
                slipping |= bit;
                if slips || along(*force) > share {
                    sliding.slip(*force, share, &along)
                } else {
                    along(share)
                }
            };
            total = total + *force;
        }
        state.slipping = slipping;
        if state.all_slip() {
            state.join(total, self.one, self.weights());
        }
        total
    }
}
