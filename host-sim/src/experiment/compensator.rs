//! What the control law is told about the simulated axes.
//!
//! *Matched*: the plant's own parameters, as in the thesis' simulation. *Virtual machine*: the truth is hidden, and the
//! law has a set of parameters that is deliberately wrong by the factors below; it stands for an identification
//! until one exists.

use quadrant::friction::PerDirection;
use quadrant::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant::settings::{AxisSettings, FrictionSettings, StageSettings};

use crate::plant::{AxisTruth, StageTruth};

/// How the virtual machine's compensator errs: assumed over true.
pub mod wrong {
    /// Coulomb level.
    pub const COULOMB: f64 = 1.08;
    /// Breakaway level.
    pub const BREAKAWAY: f64 = 0.92;
    /// Stribeck velocity.
    pub const STRIBECK_VELOCITY: f64 = 1.3;
    /// Viscous friction.
    pub const VISCOUS: f64 = 0.85;
    /// Stiffness of all elements.
    pub const STIFFNESS: f64 = 1.2;
}

/// Which knowledge the compensator has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knowledge {
    /// The plant's own parameters.
    Matched,
    /// Deliberately wrong ones, and an imperfect plant.
    VirtualMachine,
}

impl Knowledge {
    /// Both, simulation first.
    pub const ALL: [Self; 2] = [Self::Matched, Self::VirtualMachine];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Matched => "matched",
            Self::VirtualMachine => "virtual machine",
        }
    }

    /// The default stage's settings with this knowledge of the truth's friction.
    fn settings(self) -> StageSettings {
        let mut stage = StageSettings::default();
        for (axis, truth) in stage.axes.iter_mut().zip(&StageTruth::real().axes) {
            self.tell(axis, truth);
        }
        stage
    }

    fn tell(self, axis: &mut AxisSettings, truth: &AxisTruth) {
        match self {
            Self::Matched => {
                axis.friction = FrictionSettings {
                    sliding: truth.friction.map(|model| with_total_damping(model, truth)),
                    gms: truth.gms.clone(),
                };
            }
            Self::VirtualMachine => {
                // The law's own four elements, one curve for both senses, and the errors above.
                let mean = mean(&truth.friction);
                axis.friction.sliding = PerDirection::both(StaticFriction {
                    curve: StribeckCurve {
                        coulomb_v: mean.curve.coulomb_v * wrong::COULOMB,
                        breakaway_v: mean.curve.breakaway_v * wrong::BREAKAWAY,
                        stribeck_velocity_mm_s: mean.curve.stribeck_velocity_mm_s
                            * wrong::STRIBECK_VELOCITY,
                        exponent: mean.curve.exponent,
                    },
                    viscous_v_s_per_mm: with_total_damping(&mean, truth).viscous_v_s_per_mm
                        * wrong::VISCOUS,
                });
                for element in &mut axis.friction.gms.elements {
                    element.stiffness_v_per_mm *= wrong::STIFFNESS;
                }
            }
        }
    }
}

/// A simulated stage, and the settings of the law that runs on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// What the settings know of the stage.
    pub knowledge: Knowledge,
    /// The settings.
    pub stage: StageSettings,
    /// The stage.
    pub truth: StageTruth,
}

impl Setup {
    /// The ideal stage, and settings that hold its own parameters.
    pub fn matched() -> Self {
        let knowledge = Knowledge::Matched;
        Self {
            knowledge,
            stage: knowledge.settings(),
            truth: StageTruth::ideal(),
        }
    }

    /// The stage with everything a real one has, and settings that were made without knowing it.
    pub fn virtual_machine(stage: StageSettings) -> Self {
        Self {
            knowledge: Knowledge::VirtualMachine,
            stage,
            truth: StageTruth::real(),
        }
    }

    /// Both, the virtual machine with its own settings.
    pub fn both() -> [Self; 2] {
        [
            Self::matched(),
            Self::virtual_machine(Knowledge::VirtualMachine.settings()),
        ]
    }
}

/// What a run at constant velocity shows as viscous friction: sigma, and the linear damping B / A, which no motion
/// can tell from it.
fn with_total_damping(model: &StaticFriction, truth: &AxisTruth) -> StaticFriction {
    StaticFriction {
        viscous_v_s_per_mm: model.viscous_v_s_per_mm + truth.damping_per_s / truth.gain_mm_per_v_s2,
        ..*model
    }
}

fn mean(both: &PerDirection<StaticFriction>) -> StaticFriction {
    let (positive, negative) = (&both.positive, &both.negative);
    let middle = |pick: fn(&StaticFriction) -> f64| 0.5 * (pick(positive) + pick(negative));
    StaticFriction {
        curve: StribeckCurve {
            coulomb_v: middle(|model| model.curve.coulomb_v),
            breakaway_v: middle(|model| model.curve.breakaway_v),
            ..positive.curve
        },
        viscous_v_s_per_mm: middle(|model| model.viscous_v_s_per_mm),
    }
}
