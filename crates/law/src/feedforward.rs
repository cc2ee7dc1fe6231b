//! Feedforward of friction and inertia, from the reference alone.
//!
//! Each effect is counted once, in every combination:
//!
//! | kind         | Coulomb and Stribeck level           | pre-sliding       | viscous |
//! |--------------|--------------------------------------|-------------------|---------|
//! | none         | -                                    | -                 | -       |
//! | static       | `s(v) sgn(v)`                        | -                 | `sigma v` |
//! | GMS          | the elements, on a constant `s = Fs` | elements          | -       |
//! | combined     | the elements, on `s(v)`              | elements          | `sigma v` |
//! | Dahl         | the bristle, on a constant `s = Fc`  | bristle           | `sigma v` |
//! | LuGre        | the bristles, on `s(v)`              | bristles, damped  | `sigma v`, which is LuGre's sigma2 |
//! | smoothed GMS | the elements, on `s(v)`              | smoothed elements | `sigma v` |
//!
//! Inertia (`a / A`) is separate and acts with any kind.
//!
//! The elements move with GMS, combined and the smoothed GMS; the bristle moves with Dahl and LuGre. When a
//! change of settings goes from one group to the other, the force goes with it: the bristle takes the elements' sum, the
//! elements take their weights' shares of the bristle's force. After kinds without either, the model begins as in a lasting
//! motion. The rest of the elements' memory is right again once the
//! reference has moved over the pre-sliding range in one sense.

use crate::hint::cold_path;

use crate::friction::dahl::Dahl;
use crate::friction::gms::{Gms, GmsState};
use crate::friction::lugre::Lugre;
use crate::friction::smoothed_gms::SmoothedGms;
use crate::friction::stribeck::{Sliding, SlidingTable};
use crate::friction::{Direction, FrictionSettings, PerDirection};
use crate::scalar::{Quantity, Scalar};

/// The friction models that act together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(
    feature = "names",
    derive(
        strum::AsRefStr,
        strum::EnumString,
        strum::VariantArray,
        strum::VariantNames,
        strum::EnumCount
    ),
    strum(serialize_all = "kebab-case")
)]
pub enum FeedforwardKind {
    /// No friction feedforward; inertia may act.
    #[default]
    None,
    /// The static model: Stribeck curve and viscous friction.
    Static,
    /// GMS alone, at the breakaway level.
    Gms,
    /// GMS on the Stribeck curve, and the static model's viscous friction.
    Combined,
    /// Dahl's model at the Coulomb level, and the static model's viscous friction.
    Dahl,
    /// The LuGre model on the Stribeck curve.
    Lugre,
    /// The smoothed GMS on the Stribeck curve, and the static model's viscous friction.
    SmoothedGms,
}

impl FeedforwardKind {
    /// All kinds, in the order of their tables.
    #[cfg(feature = "names")]
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .unwrap();

    /// Those that the thesis compares, in the order of its tables.
    pub const THESIS: [Self; 4] = [Self::None, Self::Static, Self::Gms, Self::Combined];

    /// The name of it in tables and figures.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Static => "static",
            Self::Gms => "GMS",
            Self::Combined => "static + GMS",
            Self::Dahl => "Dahl",
            Self::Lugre => "LuGre",
            Self::SmoothedGms => "smoothed GMS",
        }
    }

    /// True if a pre-sliding model acts.
    const fn has_presliding(self) -> bool {
        !matches!(self, Self::None | Self::Static)
    }

    /// True if viscous friction acts.
    const fn has_viscous(self) -> bool {
        !matches!(self, Self::None | Self::Gms)
    }
}

/// Least gain of the pre-sliding model with which it adopts the whole of a voltage.
const LEAST_GAIN: f64 = 0.1;

/// The share of each effect that is fed forward.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct FeedforwardGains {
    /// Share of `s(v) sgn(v)`, 0..=2; 1 is the identified value.
    pub level: f64,
    /// Share of `sigma v`, 0..=2.
    pub viscous: f64,
    /// Share of the pre-sliding model's force, whichever model acts, 0..=2.
    pub presliding: f64,
    /// Inertia, V s^2/mm: 1 / A for the whole of it, 0 for none.
    pub inertia_v_s2_per_mm: f64,
}

impl FeedforwardGains {
    /// The whole of each identified effect, and this inertia.
    pub const fn whole(inertia_v_s2_per_mm: f64) -> Self {
        Self {
            level: 1.0,
            viscous: 1.0,
            presliding: 1.0,
            inertia_v_s2_per_mm,
        }
    }
}

/// The reference's motion in one tick, as far ahead as the feedforward looks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceStep<S> {
    /// Displacement since the last tick, mm.
    pub displacement: S,
    /// Velocity of the reference, mm/s.
    pub velocity: S,
    /// Acceleration of the reference, mm/s^2.
    pub acceleration: S,
}

/// The feedforward, term by term, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedforwardTerms<S> {
    /// The static model's Coulomb and Stribeck level.
    pub level: S,
    /// Viscous friction, `sigma v`.
    pub viscous: S,
    /// The pre-sliding model: the GMS elements, smoothed or not, or the bristles.
    pub presliding: S,
    /// Inertia, `a / A`.
    pub inertia: S,
}

impl<S: Scalar> FeedforwardTerms<S> {
    /// The sum of all terms, V.
    pub fn total(&self) -> S {
        self.level + self.viscous + self.presliding + self.inertia
    }

    /// The friction, V.
    pub fn friction(&self) -> S {
        self.level + self.viscous + self.presliding
    }

    /// Scales the friction but for its viscous part by a [`Quantity::Multiplier`].
    pub(crate) fn gate_friction(&mut self, gate: S) {
        for term in [&mut self.level, &mut self.presliding] {
            *term = term.times(gate, Quantity::Multiplier);
        }
    }

    /// Scales the friction by a [`Quantity::Multiplier`].
    pub(crate) fn scale_friction(&mut self, scale: S) {
        for term in [&mut self.level, &mut self.viscous, &mut self.presliding] {
            *term = term.times(scale, Quantity::Multiplier);
        }
    }
}

/// The pre-sliding model of a kind, with what only that model needs.
#[derive(Clone, Debug, PartialEq)]
enum Presliding<S: Scalar, const N: usize> {
    /// Combined: the elements on the Stribeck curve.
    Gms(GmsOnSurface<S, N>),
    /// GMS: the elements at the breakaway level.
    Breakaway(GmsOnSurface<S, N>),
    /// None: nothing moves.
    None,
    /// Static: no pre-sliding, the Stribeck curve in the sense of the velocity.
    Static(SlidingTable<S>),
    Smoothed {
        elements: SmoothedGms<S, N>,
        surface: SlidingTable<S>,
    },
    Lugre(Lugre<S>),
    Dahl(Dahl<S>),
}

/// The elements and what they slide on, the tables last.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
struct GmsOnSurface<S: Scalar, const N: usize> {
    elements: Gms<S, N>,
    breakaway: PerDirection<Sliding<S>>,
    surface: SlidingTable<S>,
}

/// The friction state of the feedforward; slack by default.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedforwardState<S: Scalar, const N: usize> {
    memory: GmsState<S, N>,
    /// No pre-sliding model acts: the memory is not of the present.
    idle: bool,
}

impl<S: Scalar, const N: usize> Default for FeedforwardState<S, N> {
    fn default() -> Self {
        Self {
            memory: GmsState::default(),
            idle: false,
        }
    }
}

impl<S: Scalar, const N: usize> FeedforwardState<S, N> {
    /// The friction of the model that moved last, V.
    pub fn force(&self) -> S {
        self.memory.total()
    }
}

/// The feedforward ready for the tick; `N` is the room for GMS elements.
///
/// ```
/// use quadrant_law::feedforward::{Feedforward, FeedforwardKind, FeedforwardState, ReferenceStep};
///
/// let x = quadrant_settings::presets::x_axis();
/// let gains = &x.feedforward.gains;
/// let feedforward = Feedforward::<f64, 10>::build(FeedforwardKind::Static, gains, &x.friction, 1e-4);
/// let mut state = FeedforwardState::default();
/// let step = ReferenceStep { displacement: 1e-3, velocity: 10.0, acceleration: 0.0 };
/// let terms = feedforward.step(&mut state, step);
/// let exact = x.friction.sliding.positive.friction_v(10.0);
/// assert!((terms.total() / exact - 1.0).abs() < 1e-3);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Feedforward<S: Scalar, const N: usize> {
    coulomb_gain: S::Gain,
    /// Zero where the kind has no pre-sliding model, or no viscous friction.
    presliding_gain: S::Gain,
    /// One over `presliding_gain`, at most one over [`LEAST_GAIN`].
    per_presliding_gain: S::Gain,
    /// Largest friction before sliding, V.
    most: S,
    viscous: PerDirection<S::Gain>,
    inertia: S::Gain,
    presliding: Presliding<S, N>,
}

impl<S: Scalar, const N: usize> Feedforward<S, N> {
    /// Makes the feedforward from validated parameters. Settings time only.
    pub fn build(
        kind: FeedforwardKind,
        gains: &FeedforwardGains,
        friction: &FrictionSettings,
        period_s: f64,
    ) -> Self {
        let mut feedforward = Self::blank();
        feedforward.build_over(kind, gains, friction, period_s);
        feedforward
    }

    /// None at all, to be [built over](Self::build_over).
    pub(crate) fn blank() -> Self {
        Self {
            presliding: Presliding::None,
            coulomb_gain: S::Gain::default(),
            presliding_gain: S::Gain::default(),
            per_presliding_gain: S::Gain::default(),
            most: S::ZERO,
            viscous: PerDirection::default(),
            inertia: S::Gain::default(),
        }
    }

    /// Feeds nothing forward. The tables stay: to clear them would take as long as to fill them.
    pub(crate) fn switch_off(&mut self) {
        self.coulomb_gain = S::Gain::default();
        self.presliding_gain = S::Gain::default();
        self.viscous = PerDirection::default();
        self.inertia = S::Gain::default();
    }

    /// As [`build`](Self::build), in place.
    #[inline(never)]
    pub(crate) fn build_over(
        &mut self,
        kind: FeedforwardKind,
        gains: &FeedforwardGains,
        friction: &FrictionSettings,
        period_s: f64,
    ) {
        let share = |value| S::gain(value, Quantity::Voltage, Quantity::Voltage);
        let acts = |does: bool| if does { 1.0 } else { 0.0 };
        self.coulomb_gain = share(gains.level);
        self.presliding_gain = share(acts(kind.has_presliding()) * gains.presliding);
        self.per_presliding_gain = share(1.0 / gains.presliding.max(LEAST_GAIN));
        let levels = [&friction.sliding.positive, &friction.sliding.negative]
            .map(|model| model.curve.breakaway_v.max(model.curve.coulomb_v));
        self.most = S::quantise(levels[0].max(levels[1]), Quantity::Voltage);
        let viscous = acts(kind.has_viscous()) * gains.viscous;
        self.viscous = friction.sliding.map(|model| {
            S::gain(
                viscous * model.viscous_v_s_per_mm,
                Quantity::Velocity,
                Quantity::Voltage,
            )
        });
        self.inertia = S::gain(
            gains.inertia_v_s2_per_mm,
            Quantity::Acceleration,
            Quantity::Voltage,
        );
        self.presliding = Presliding::without_tables(kind, friction, period_s);
        self.presliding.fill_tables(friction, period_s);
    }

    /// The memory of slack springs.
    pub(crate) fn start(&self) -> FeedforwardState<S, N> {
        FeedforwardState {
            idle: !self.presliding.acts(),
            ..FeedforwardState::default()
        }
    }

    /// Goes on after a change of settings at a velocity, mm/s. Where no pre-sliding model acted before, the one that acts now begins
    /// as it is in a lasting motion.
    #[cold]
    #[inline(never)]
    pub(crate) fn go_on(&self, state: &mut FeedforwardState<S, N>, velocity: S) {
        let acts = self.presliding.acts();
        if acts && state.idle {
            state.memory = GmsState::default();
            if velocity != S::ZERO {
                let direction = Direction::of(velocity);
                let level = self.presliding.level(velocity.magnitude(), direction);
                let force = match direction {
                    Direction::Positive => level,
                    Direction::Negative => -level,
                };
                state.memory.slide(force, direction);
            }
        }
        state.idle = !acts;
    }

    /// Lets the pre-sliding model carry `voltage` more, V, as far as friction can be; returns by how much the output grows, V: by what the
    /// integral is to lose. The static model carries nothing at rest; its level, which is about to begin, stands for as much.
    #[cold]
    #[inline(never)]
    pub(crate) fn take_over(&self, state: &mut FeedforwardState<S, N>, voltage: S) -> S {
        if let Presliding::Static(_) = self.presliding {
            return voltage.within(self.most.scale(self.coulomb_gain));
        }
        if self.presliding_gain == S::Gain::default() {
            return S::ZERO;
        }
        let force = state.force();
        let change = (force + voltage.scale(self.per_presliding_gain)).within(self.most) - force;
        match &self.presliding {
            Presliding::None | Presliding::Static(_) => {}
            Presliding::Gms(GmsOnSurface { elements, .. })
            | Presliding::Breakaway(GmsOnSurface { elements, .. }) => {
                elements.load(&mut state.memory, change);
            }
            Presliding::Smoothed { elements, .. } => elements.load(&mut state.memory, change),
            Presliding::Lugre(_) | Presliding::Dahl(_) => {
                state.memory.as_bristles(|bristles| bristles.load(change));
            }
        }
        change.scale(self.presliding_gain)
    }

    /// Advances by one control period.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedforwardState<S, N>,
        reference: ReferenceStep<S>,
    ) -> FeedforwardTerms<S> {
        let (velocity, speed) = (reference.velocity, reference.velocity.magnitude());
        let direction = Direction::of(velocity);
        let viscous = velocity.scale(*self.viscous.of(direction));
        let (model, sliding) = match &self.presliding {
            Presliding::Gms(model) => (model, model.surface.at(speed, direction)),
            Presliding::Breakaway(model) => (model, *model.breakaway.of(direction)),
            _ => {
                cold_path();
                let (level, presliding) = self.step_other(state, reference);
                let inertia = reference.acceleration.scale(self.inertia);
                return FeedforwardTerms {
                    level,
                    viscous,
                    presliding,
                    inertia,
                };
            }
        };
        let memory = &mut state.memory;
        let force = model.elements.step(memory, reference.displacement, sliding);
        FeedforwardTerms {
            level: S::ZERO,
            viscous,
            presliding: force.scale(self.presliding_gain),
            inertia: reference.acceleration.scale(self.inertia),
        }
    }

    /// The level and the pre-sliding force of a kind without GMS elements, V: apart, so that those have the registers to themselves.
    #[inline(never)]
    fn step_other(
        &self,
        state: &mut FeedforwardState<S, N>,
        reference: ReferenceStep<S>,
    ) -> (S, S) {
        let (velocity, displacement) = (reference.velocity, reference.displacement);
        let (speed, direction) = (velocity.magnitude(), Direction::of(velocity));
        let memory = &mut state.memory;
        let force = match &self.presliding {
            Presliding::Static(surface) => {
                return (
                    self.static_level(surface.at(speed, direction).level, velocity),
                    S::ZERO,
                );
            }
            Presliding::Smoothed { elements, surface } => {
                elements.step(memory, displacement, surface.at(speed, direction))
            }
            Presliding::Lugre(model) => {
                memory.as_bristles(|bristles| model.step(bristles, displacement, speed))
            }
            Presliding::Dahl(model) => {
                memory.as_bristles(|bristles| model.step(bristles, displacement))
            }
            // None has no friction; the elements of the others are stepped above.
            Presliding::None | Presliding::Gms(_) | Presliding::Breakaway(_) => S::ZERO,
        };
        (S::ZERO, force.scale(self.presliding_gain))
    }

    /// The static model's level in the sense of the velocity, V; none at rest.
    #[inline(never)]
    fn static_level(&self, level: S, velocity: S) -> S {
        let level = level.scale(self.coulomb_gain);
        if velocity < S::ZERO {
            -level
        } else if velocity != S::ZERO {
            level
        } else {
            S::ZERO
        }
    }
}

impl<S: Scalar, const N: usize> Presliding<S, N> {
    /// True if there is a pre-sliding model.
    fn acts(&self) -> bool {
        !matches!(self, Self::None | Self::Static(_))
    }

    /// The force of a lasting motion, V, not negative.
    fn level(&self, speed: S, direction: Direction) -> S {
        match self {
            Self::None => S::ZERO,
            Self::Static(surface)
            | Self::Smoothed { surface, .. }
            | Self::Gms(GmsOnSurface { surface, .. }) => surface.at(speed, direction).level,
            Self::Breakaway(model) => model.breakaway.of(direction).level,
            Self::Lugre(model) => model.level(speed, direction),
            Self::Dahl(model) => model.level(direction),
        }
    }

    /// Fills the tables of a model made by [`without_tables`](Self::without_tables) of the same parameters.
    fn fill_tables(&mut self, friction: &FrictionSettings, period_s: f64) {
        let curves = friction.sliding.map(|model| model.curve);
        match self {
            Self::None => {}
            Self::Static(surface)
            | Self::Gms(GmsOnSurface { surface, .. })
            | Self::Breakaway(GmsOnSurface { surface, .. })
            | Self::Smoothed { surface, .. } => {
                surface.fill(&curves, friction.gms.attraction_v_s, period_s);
            }
            Self::Lugre(model) => {
                if let Some(parameters) = &friction.lugre {
                    model.fill(parameters, &curves, period_s);
                }
            }
            // Its tables are small, and made with it.
            Self::Dahl(_) => {}
        }
    }

    /// The model of a kind. Settings without the parameters of their kind are refused before they come here; the
    /// elements would stand in.
    fn without_tables(kind: FeedforwardKind, friction: &FrictionSettings, period_s: f64) -> Self {
        let (sliding, gms) = (&friction.sliding, &friction.gms);
        match (kind, &friction.lugre, &friction.dahl) {
            (FeedforwardKind::Lugre, Some(_), _) => Self::Lugre(Lugre::blank()),
            (FeedforwardKind::Dahl, _, Some(dahl)) => Self::Dahl(Dahl::build(
                dahl,
                sliding.map(|model| model.curve.coulomb_v),
            )),
            (FeedforwardKind::SmoothedGms, ..) => Self::Smoothed {
                elements: SmoothedGms::build(
                    &gms.elements,
                    &friction.smoothed_gms,
                    friction.mean_breakaway_v(),
                ),
                surface: SlidingTable::blank(),
            },
            (FeedforwardKind::None, ..) => Self::None,
            (FeedforwardKind::Static, ..) => Self::Static(SlidingTable::blank()),
            (FeedforwardKind::Gms, ..) => Self::Breakaway(GmsOnSurface::build(friction, period_s)),
            _ => Self::Gms(GmsOnSurface::build(friction, period_s)),
        }
    }
}

impl<S: Scalar, const N: usize> GmsOnSurface<S, N> {
    /// The elements without the tables of their surface.
    #[inline(always)]
    fn build(friction: &FrictionSettings, period_s: f64) -> Self {
        let attraction_v_s = friction.gms.attraction_v_s;
        Self {
            elements: Gms::build(&friction.gms.elements),
            surface: SlidingTable::blank(),
            breakaway: friction
                .sliding
                .map(|model| Sliding::constant(model.curve.breakaway_v, attraction_v_s, period_s)),
        }
    }
}
