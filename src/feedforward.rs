//! Feedforward of friction and inertia, from the reference alone.
//!
//! Each effect is counted once, whatever is combined:
//!
//! | kind     | Coulomb and Stribeck level            | pre-sliding | viscous |
//! |----------|---------------------------------------|-------------|---------|
//! | none     | -                                     | -           | -       |
//! | static   | `s(v) sgn(v)`                         | -           | `sigma v` |
//! | GMS      | the elements, on a constant `s = Fs`  | elements    | -       |
//! | combined | the elements, on `s(v)`               | elements    | `sigma v` |
//!
//! Inertia (`a / A`) is separate and acts with any kind.

use serde::{Deserialize, Serialize};

use crate::friction::gms::{Gms, GmsParameters, GmsState};
use crate::friction::stribeck::{Sliding, SlidingTable, StaticFriction};
use crate::friction::{Direction, PerDirection};
use crate::scalar::{Quantity, Scalar};

/// Which friction models act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeedforwardKind {
    /// No friction feedforward.
    #[default]
    None,
    /// The static model: Stribeck curve and viscous friction.
    Static,
    /// GMS alone, at the breakaway level.
    Gms,
    /// GMS on the Stribeck curve, and the static model's viscous friction.
    Combined,
}

impl FeedforwardKind {
    /// All kinds, in the order of the thesis' tables.
    pub const ALL: [Self; 4] = [Self::None, Self::Static, Self::Gms, Self::Combined];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Static => "static",
            Self::Gms => "GMS",
            Self::Combined => "static + GMS",
        }
    }

    /// Whether the static model's `s(v) sgn(v)` acts.
    const fn has_static_level(self) -> bool {
        matches!(self, Self::Static)
    }

    /// Whether the GMS elements act.
    const fn has_gms(self) -> bool {
        matches!(self, Self::Gms | Self::Combined)
    }

    /// Whether viscous friction acts.
    const fn has_viscous(self) -> bool {
        matches!(self, Self::Static | Self::Combined)
    }
}

/// How much of each effect is fed forward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedforwardGains {
    /// Share of `s(v) sgn(v)`, 0..=2; 1 is the identified value.
    pub level: f64,
    /// Share of `sigma v`, 0..=2.
    pub viscous: f64,
    /// Share of the GMS elements' force, 0..=2.
    pub gms: f64,
    /// Inertia, V s^2/mm: 1 / A for the whole of it, 0 for none.
    pub inertia_v_s2_per_mm: f64,
}

/// What the reference does in one tick, seen far enough ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceStep<S> {
    /// Displacement since the last tick, mm.
    pub displacement: S,
    /// Velocity, mm/s.
    pub velocity: S,
    /// Acceleration, mm/s^2.
    pub acceleration: S,
}

/// What is fed forward, term by term, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedforwardTerms<S> {
    /// The static model's Coulomb and Stribeck level.
    pub level: S,
    /// Viscous friction.
    pub viscous: S,
    /// The GMS elements.
    pub gms: S,
    /// Inertia.
    pub inertia: S,
}

impl<S: Scalar> FeedforwardTerms<S> {
    /// The sum of all terms, V.
    #[inline(always)]
    pub fn total(&self) -> S {
        S::ZERO + self.level + self.viscous + self.gms + self.inertia
    }
}

/// The feedforward ready for the tick; `N` is the room for GMS elements.
#[derive(Clone, Debug, PartialEq)]
pub struct Feedforward<S: Scalar, const N: usize> {
    kind: FeedforwardKind,
    surface: SlidingTable<S>,
    breakaway: PerDirection<Sliding<S>>,
    gms: Gms<S, N>,
    level_gain: S::Gain,
    gms_gain: S::Gain,
    viscous: PerDirection<S::Gain>,
    inertia: S::Gain,
}

impl<S: Scalar, const N: usize> Feedforward<S, N> {
    /// Makes the feedforward from validated parameters. Settings time only.
    pub fn build(
        kind: FeedforwardKind,
        gains: &FeedforwardGains,
        friction: &PerDirection<StaticFriction>,
        gms: &GmsParameters,
        period_s: f64,
    ) -> Self {
        let share = |value| S::gain(value, Quantity::Voltage, Quantity::Voltage);
        Self {
            kind,
            surface: SlidingTable::build(
                &friction.map(|model| model.curve),
                gms.attraction_v_s,
                period_s,
            ),
            breakaway: friction.map(|model| {
                Sliding::constant(model.curve.breakaway_v, gms.attraction_v_s, period_s)
            }),
            gms: Gms::build(&gms.elements),
            level_gain: share(gains.level),
            gms_gain: share(gains.gms),
            viscous: friction.map(|model| {
                S::gain(
                    gains.viscous * model.viscous_v_s_per_mm,
                    Quantity::Velocity,
                    Quantity::Voltage,
                )
            }),
            inertia: S::gain(
                gains.inertia_v_s2_per_mm,
                Quantity::Acceleration,
                Quantity::Voltage,
            ),
        }
    }

    /// One control period.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut GmsState<S, N>,
        reference: ReferenceStep<S>,
    ) -> FeedforwardTerms<S> {
        let mut terms = FeedforwardTerms {
            inertia: reference.acceleration.scale(self.inertia),
            ..FeedforwardTerms::default()
        };
        let direction = if reference.velocity < S::ZERO {
            Direction::Negative
        } else {
            Direction::Positive
        };
        if self.kind.has_viscous() {
            terms.viscous = reference.velocity.scale(*self.viscous.of(direction));
        }
        let sliding = match self.kind {
            FeedforwardKind::Gms => *self.breakaway.of(direction),
            _ => self.surface.at(reference.velocity.magnitude(), direction),
        };
        if self.kind.has_static_level() && reference.velocity != S::ZERO {
            let level = sliding.level.scale(self.level_gain);
            terms.level = match direction {
                Direction::Positive => level,
                Direction::Negative => -level,
            };
        }
        // The elements move with any kind: their springs are loaded when a change of settings makes them act.
        let force = self.gms.step(state, reference.displacement, sliding);
        if self.kind.has_gms() {
            terms.gms = force.scale(self.gms_gain);
        }
        terms
    }
}
