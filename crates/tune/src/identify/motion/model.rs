//! Models identified from a motion record.

use heapless::Vec as ShortVec;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::gms::{GmsElement, GmsParameters};
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};

use crate::identify::single_state::with_all_models;

/// Structure of a model: its terms beside mass, viscous friction, Coulomb friction and offset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// Fitted while the axis slides, away from reversals: there a Coulomb friction that turns at once is wrong for the time that the
    /// axis sticks. Counts the voltage's hold.
    pub sliding: bool,
    /// A viscous friction for each sense of motion.
    pub directed_viscous: bool,
    /// A dead time between voltage and force.
    pub dead_time: bool,
    /// Friction that turns over a displacement and not at once.
    pub presliding: bool,
    /// A level that changes with the velocity, from Fs at rest to Fc. It may rise, too.
    pub stribeck: bool,
    /// Level and offset that change with time, in proportion.
    pub drift: bool,
    /// Level and offset that change along the travel, in proportion.
    pub along_travel: bool,
}

impl Structure {
    /// The models that are compared. The first has the four parameters that are usual (and published for EMPS); the second is the
    /// same, fitted while sliding; from the third on each has one more part than the one before, and the third than the first.
    pub const ALL: [Self; 8] = {
        let four = Self {
            sliding: false,
            directed_viscous: false,
            dead_time: false,
            presliding: false,
            stribeck: false,
            drift: false,
            along_travel: false,
        };
        let sliding = Self {
            sliding: true,
            ..four
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
        let drifting = Self {
            drift: true,
            ..stribeck
        };
        let along_travel = Self {
            along_travel: true,
            ..drifting
        };
        [
            four,
            sliding,
            directed,
            delayed,
            presliding,
            stribeck,
            drifting,
            along_travel,
        ]
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
            (self.sliding, "fitted while sliding"),
            (self.directed_viscous, "viscous per direction"),
            (self.dead_time, "dead time"),
            (self.presliding, "pre-sliding"),
            (self.stribeck, "level by velocity"),
            (self.drift, "drift"),
            (self.along_travel, "along the travel"),
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
    /// One standard deviation: see [`fit_motion`](super::fit_motion).
    pub standard_error: f64,
    /// Factor that turns the value into newtons, metres and seconds, but for the force per volt; and the unit it then
    /// has.
    pub to_si: (f64, &'static str),
}

/// A parameter that a record hardly determines.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// Name of the parameter.
    pub name: String,
    /// Its standard error over its value; of an inertia that takes less voltage than the model leaves over, that ratio if it is larger.
    pub share: f64,
    /// Motion that would determine it.
    pub remedy: &'static str,
}

/// Standard error of a parameter, over its value, above which it is in doubt.
const DOUBTFUL_SHARE: f64 = 0.25;

/// A model of an axis' inertia and friction, as seen at the amplifier's input.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionModel {
    pub structure: Structure,
    /// M' = 1/A, V s²/mm.
    pub inertia_v_s2_per_mm: f64,
    /// Static friction each way, viscous friction included; Fs = Fc where the level does not change with the velocity. Where
    /// friction drifts, in the middle of the record; where it changes along the travel, in its middle.
    pub friction: PerDirection<StaticFriction>,
    /// Offset, V: the amplifier's, gravity, and half the difference of the two Coulomb levels.
    pub offset_v: f64,
    /// Td, from a voltage's sample to its force, s.
    pub dead_time_s: f64,
    /// The part of it that is the voltage's hold, s: half the record's sampling time.
    pub hold_s: f64,
    /// Knot, mm, and level, V, of each element, zero for what is left out; empty where friction turns at once.
    pub elements: Vec<(f64, f64)>,
    /// Change of level and offset from the middle of the record to its end.
    pub drift: Change,
    /// Change of level and offset from the middle of the travel to its upper end.
    pub along_travel: Change,
    /// Middle of the record and of its travel, and half of each.
    pub span: Span,
    /// All of that, with standard errors.
    pub estimates: Vec<Estimate>,
    /// Norm of the residual over that of the voltage, over the rows of the fit.
    pub relative_error: f64,
    /// RMS of the residual over that of the voltage that inertia takes: above one, what the model lacks may pass for inertia.
    pub residual_over_inertia: f64,
}

/// A linear change of friction's level and of the offset, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    pub level_v: f64,
    pub offset_v: f64,
}

/// The record that changes are counted over: their middles, and half of their extents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Middle of the record, from its first sample, and half its duration, s.
    pub time_s: (f64, f64),
    /// Middle and half of the travel, mm.
    pub position_mm: (f64, f64),
}

impl Span {
    /// A time as -1 at the start of the record to 1 at its end; later times count as its end.
    pub(super) fn time_share(&self, time_s: f64) -> f64 {
        ((time_s - self.time_s.0) / self.time_s.1).clamp(-1.0, 1.0)
    }

    /// The same travel, at the end of the record and ever after.
    pub(super) fn afterwards(self) -> Self {
        Self {
            time_s: (f64::MIN, 1.0),
            ..self
        }
    }

    /// A position as -1 at the lower end of the travel to 1 at the upper; beyond them, as at the end.
    pub(super) fn travel_share(&self, position_mm: f64) -> f64 {
        ((position_mm - self.position_mm.0) / self.position_mm.1).clamp(-1.0, 1.0)
    }
}

/// Displacement over which a friction without pre-sliding turns, mm, for a simulation.
pub(super) const AT_ONCE_MM: f64 = 1e-4;
/// Time in which sliding friction follows its curve, s: a motion record shows none, so the shortest that any control rate of
/// the firmware resolves.
const LAG_S: f64 = 1e-3;

impl MotionModel {
    /// Its friction as GMS parameters.
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
                .filter(|(_, level_v)| *level_v > 0.0)
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

    /// The inertia and the damping, if the record hardly determines them: the plant is made of both.
    pub fn doubts(&self) -> Vec<Doubt> {
        let doubt = |estimate: &Estimate| {
            let mut share = estimate.standard_error / estimate.value.abs();
            let remedy = match estimate.name.as_str() {
                "M'" => {
                    if self.residual_over_inertia > 1.0 {
                        share = share.max(self.residual_over_inertia);
                    }
                    "moves that accelerate more, back and forth"
                }
                name if name.starts_with("sigma") => {
                    "moves at several speeds both ways, the fastest included"
                }
                _ => return None,
            };
            (share > DOUBTFUL_SHARE).then(|| Doubt {
                name: estimate.name.clone(),
                share,
                remedy,
            })
        };
        self.estimates.iter().filter_map(doubt).collect()
    }

    /// Its friction as settings hold it: that of the middle of the record and of the travel.
    pub fn friction_settings(&self) -> FrictionSettings {
        with_all_models(self.friction, self.gms())
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
