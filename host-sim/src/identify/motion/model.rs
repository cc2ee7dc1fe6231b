//! Models identified from a motion record.

use heapless::Vec as ShortVec;
use quadrant::control::plant_model::PlantModel;
use quadrant::friction::FrictionSettings;
use quadrant::friction::PerDirection;
use quadrant::friction::gms::{GmsElement, GmsParameters};
use quadrant::friction::stribeck::{StaticFriction, StribeckCurve};

use crate::identify::single_state::with_all_models;
use crate::plant::{AxisParameters, Drive, FrictionParameters, Imperfections};

/// Structure of a model: its terms beside mass, viscous friction, Coulomb friction and offset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// A viscous friction for each sense of motion.
    pub directed_viscous: bool,
    /// A dead time between voltage and force.
    pub dead_time: bool,
    /// Friction that turns over a displacement and not at once.
    pub presliding: bool,
    /// A level that changes with the velocity, from Fs at rest to Fc. It may rise, too: that is no Stribeck effect, but
    /// what some records hold.
    pub stribeck: bool,
}

impl Structure {
    /// The models that are compared, each with one more part than the one before; the first has the four parameters
    /// that are usual (and published for EMPS).
    pub const ALL: [Self; 5] = {
        let four = Self {
            directed_viscous: false,
            dead_time: false,
            stribeck: false,
            presliding: false,
        };
        let directed = Self {
            directed_viscous: true,
            ..four
        };
        let delayed = Self {
            dead_time: true,
            ..directed
        };
        let presliding = Self {
            presliding: true,
            ..delayed
        };
        let stribeck = Self {
            stribeck: true,
            ..presliding
        };
        [four, directed, delayed, presliding, stribeck]
    };

    /// Returns the terms added to those of the model before it in [`ALL`](Self::ALL), for a table.
    pub fn addition(&self) -> String {
        let name = self.name();
        name.rfind('+')
            .map_or_else(|| name.clone(), |place| name[place..].to_owned())
    }

    /// All that it holds.
    pub fn name(&self) -> String {
        let mut name = "mass, viscous, Coulomb, offset".to_owned();
        for (holds, part) in [
            (self.directed_viscous, "viscous per direction"),
            (self.dead_time, "dead time"),
            (self.presliding, "pre-sliding"),
            (self.stribeck, "level by velocity"),
        ] {
            if holds {
                name = format!("{name} + {part}");
            }
        }
        name
    }
}

/// A parameter as a table shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    pub name: String,
    pub unit: &'static str,
    pub value: f64,
    /// One standard deviation, over blocks of the record.
    pub standard_error: f64,
    /// Factor that turns the value into newtons, metres and seconds, but for the force per volt; and the unit it then
    /// has.
    pub to_si: (f64, &'static str),
}

/// A model of an axis' inertia and friction, as seen at the amplifier's input.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionModel {
    pub structure: Structure,
    /// M' = 1/A, V s²/mm.
    pub inertia_v_s2_per_mm: f64,
    /// Static friction each way, viscous friction included; Fs = Fc without a Stribeck part.
    pub friction: PerDirection<StaticFriction>,
    /// Offset, V: the amplifier's, gravity, and half the difference of the two Coulomb levels.
    pub offset_v: f64,
    /// Td, from a voltage's sample to its force, s.
    pub dead_time_s: f64,
    /// The part of it that is the voltage's hold, s: half the record's sampling time.
    pub hold_s: f64,
    /// Level of each element, V, at its knot, mm; empty where friction turns at once.
    pub elements: Vec<(f64, f64)>,
    /// All of that, with standard errors.
    pub estimates: Vec<Estimate>,
    /// Norm of the residual over that of the voltage, over the rows of the fit.
    pub relative_error: f64,
}

/// Displacement over which a friction without pre-sliding turns, mm, for a simulation.
const AT_ONCE_MM: f64 = 1e-4;
/// Time in which sliding friction follows the Stribeck curve, s: a motion record does not show it.
const LAG_S: f64 = 0.03;

impl MotionModel {
    /// Its friction as GMS parameters. The rate of attraction is not in the record: it is taken as Fs in 30 ms.
    pub fn gms(&self) -> GmsParameters {
        let breakaway_v = self.friction.positive.curve.breakaway_v;
        let total: f64 = self.elements.iter().map(|(_, level)| level).sum();
        let elements: ShortVec<GmsElement, _> = if self.elements.is_empty() {
            ShortVec::from_iter([GmsElement {
                stiffness_v_per_mm: breakaway_v / AT_ONCE_MM,
                weight: 1.0,
            }])
        } else {
            self.elements
                .iter()
                .map(|&(knot_mm, level_v)| GmsElement {
                    stiffness_v_per_mm: level_v / total * breakaway_v / knot_mm,
                    weight: level_v / total,
                })
                .collect()
        };
        GmsParameters {
            elements,
            attraction_v_s: breakaway_v / LAG_S,
        }
    }

    /// True if the friction does not rise with the velocity but for its viscous part, as the firmware's model requires.
    pub fn is_stribeck(&self) -> bool {
        let curve = &self.friction.positive.curve;
        curve.breakaway_v >= curve.coulomb_v
    }

    /// Its friction as settings hold it; a level that rises with the velocity is taken at its largest.
    pub fn friction_settings(&self) -> FrictionSettings {
        let sliding = self.friction.map(|model| StaticFriction {
            curve: StribeckCurve {
                breakaway_v: model.curve.breakaway_v.max(model.curve.coulomb_v),
                ..model.curve
            },
            ..*model
        });
        with_all_models(sliding, self.gms())
    }

    /// The axis' own delay, s: without the hold, and never below zero.
    pub fn delay_s(&self) -> f64 {
        (self.dead_time_s - self.hold_s).max(0.0)
    }

    /// The linear model of the axis in motion: all its damping, no spring.
    pub fn plant(&self) -> PlantModel {
        let viscous =
            self.friction.positive.viscous_v_s_per_mm + self.friction.negative.viscous_v_s_per_mm;
        PlantModel {
            gain_mm_per_v_s2: 1.0 / self.inertia_v_s2_per_mm,
            damping_per_s: 0.5 * viscous / self.inertia_v_s2_per_mm,
            stiffness_per_s2: 0.0,
            delay_s: self.delay_s(),
        }
    }

    /// The axis that the model describes, to be simulated: without encoder noise.
    pub fn axis(&self, full_scale_v: f64) -> AxisParameters {
        AxisParameters {
            gain_mm_per_v_s2: 1.0 / self.inertia_v_s2_per_mm,
            // All damping is in the friction.
            damping_per_s: 0.0,
            stiffness_per_s2: 0.0,
            delay_s: self.delay_s(),
            friction: self.friction,
            gms: self.gms(),
            model: FrictionParameters::Gms,
            resolution_mm: 1e-6,
            full_scale_v,
            imperfections: Imperfections {
                offset_v: -self.offset_v,
                ..Imperfections::default()
            },
            drive: Drive::BallScrew,
        }
    }
}

/// Friction of one sense of motion.
pub(super) fn sliding(
    coulomb_v: f64,
    drop_v: f64,
    stribeck_velocity_mm_s: f64,
    viscous_v_s_per_mm: f64,
) -> StaticFriction {
    StaticFriction {
        curve: StribeckCurve {
            coulomb_v,
            breakaway_v: coulomb_v + drop_v,
            stribeck_velocity_mm_s,
            exponent: 1.0,
        },
        viscous_v_s_per_mm,
    }
}
