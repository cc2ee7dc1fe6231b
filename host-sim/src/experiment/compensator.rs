//! What the control law is told about the simulated axes.
//!
//! *Matched*: the plant's own parameters, as in the thesis' simulation. *Virtual machine*: the truth is hidden, and the
//! law has the settings that a commissioning of the stage found, axis by axis, as in the thesis' experiment.

use std::path::Path;

use quadrant::friction::stribeck::StaticFriction;
use quadrant::settings::StageSettings;

use crate::identify::single_state::with_all_models;
use crate::plant::{AxisTruth, StageTruth};
use crate::settings_file::{SettingsFile, SettingsFileError};

/// The stage as `quadrant commission` found it, on x, then y, then z; a test commissions it again and compares.
const IDENTIFIED: &str = include_str!("../../data/identified-stage.toml");

/// The settings that commissioning the simulated stage gave.
///
/// # Errors
/// Settings that this version refuses.
pub fn identified() -> Result<SettingsFile, SettingsFileError> {
    SettingsFile::parse(IDENTIFIED, Path::new("host-sim/data/identified-stage.toml"))
}

/// Which knowledge the compensator has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knowledge {
    /// The plant's own parameters.
    Matched,
    /// Identified ones, and an imperfect plant.
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
    /// The ideal stage, and its settings with its own friction.
    pub fn matched() -> Self {
        Self::matched_under(StageSettings::simulated())
    }

    /// The ideal stage, and these settings with its own friction: the simulation beside an experiment with the same
    /// controllers.
    pub fn matched_under(mut stage: StageSettings) -> Self {
        for (axis, truth) in stage.axes.iter_mut().zip(&StageTruth::real().axes) {
            axis.friction = with_all_models(
                truth.friction.map(|model| with_total_damping(model, truth)),
                truth.gms.clone(),
            );
        }
        Self {
            knowledge: Knowledge::Matched,
            stage,
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

    /// Both, the virtual machine with the settings that its commissioning found.
    ///
    /// # Errors
    /// Settings that this version refuses.
    pub fn both() -> Result<[Self; 2], SettingsFileError> {
        Ok([Self::matched(), Self::virtual_machine(identified()?.stage)])
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
