//! Stage and settings of a run: what the law knows of the plant.
//!
//! *Exact model*: the plant without noise, offset and ripple; the feedforward has the plant's own friction: the thesis'
//! simulation. *Identified model*: the plant with all its imperfections; the law knows no more than a commissioning of it
//! found: the thesis' experiment.
//!
//! Both run the same controllers, those that the commissioning designed by its one criterion. Between the two only the
//! model and the imperfections differ, and between two configurations only the law and its feedforward: no change is the
//! effect of a gain that one side was denied.

use quadrant_law::axes::AxisName;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_settings::StageSettings;
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::design::DesignError;
use quadrant_tune::design::{set_best_pid, with_best_pid};
use quadrant_tune::identify::single_state::with_all_models;

use crate::experiment::configuration::{Configuration, Gains};

/// The law's knowledge of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum ModelKnowledge {
    /// The plant's own friction, on a plant without imperfections.
    Exact,
    /// Identified parameters, on a plant with all its imperfections.
    Identified,
}

impl ModelKnowledge {
    /// Both, simulation first.
    pub const ALL: [Self; 2] = [Self::Exact, Self::Identified];

    /// Its name in a column's head.
    pub const fn short(self) -> &'static str {
        match self {
            Self::Exact => "friction known",
            Self::Identified => "friction identified",
        }
    }

    /// Knowledge of the law, in words that need no definition.
    pub const fn friction(self) -> &'static str {
        match self {
            Self::Exact => "friction known exactly",
            Self::Identified => "friction identified from experiments",
        }
    }

    /// Its name in files and identifiers.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact model",
            Self::Identified => "identified model",
        }
    }
}

/// A simulated stage, and the settings of the law that runs on it.
#[derive(Clone, Debug, PartialEq)]
pub struct RunConfiguration {
    /// The law's knowledge of the plant.
    pub knowledge: ModelKnowledge,
    /// The settings.
    pub stage: StageSettings,
    /// The same with the best PID on each axis, once it was designed.
    best: Option<StageSettings>,
    /// True if the settings are those that commissioning this very stage gave.
    commissioned: bool,
    pub truth: StageParameters,
}

impl RunConfiguration {
    /// The stage without imperfections, and these settings with its own friction.
    pub fn exact(mut stage: StageSettings) -> Self {
        let truth = StageParameters::ideal();
        set_exact_friction(&mut stage, &truth);
        Self {
            knowledge: ModelKnowledge::Exact,
            stage,
            best: None,
            commissioned: false,
            truth,
        }
    }

    /// The stage with everything a real one has, and these settings as they are.
    pub fn identified(stage: StageSettings) -> Self {
        Self::on(stage, StageParameters::real())
    }

    /// Another stage with everything a real one has, and settings that know no more of it than was identified.
    pub const fn on(stage: StageSettings, truth: StageParameters) -> Self {
        Self {
            knowledge: ModelKnowledge::Identified,
            stage,
            best: None,
            commissioned: false,
            truth,
        }
    }

    /// A stage with the settings that commissioning gave, of `axes` on this very stage. Their best PID is that of the settings: the
    /// best on the model, or a softer one where the axis asked for it. That of the others is designed.
    ///
    /// # Errors
    /// A model that no PID keeps the bounds on.
    pub fn commissioned(
        stage: StageSettings,
        truth: StageParameters,
        axes: &[AxisName],
    ) -> Result<Self, DesignError> {
        let mut best = stage.clone();
        for (name, axis) in AxisName::ALL.into_iter().zip(&mut best.axes) {
            if axes.contains(&name) {
                axis.feedback.law = LawKind::Pid;
                axis.feedback.nonlinear = None;
            } else {
                set_best_pid(axis, stage.rate_hz)?;
            }
        }
        Ok(Self {
            best: Some(best),
            commissioned: true,
            ..Self::on(stage, truth)
        })
    }

    /// Both, with the controllers of these settings.
    pub fn both(stage: &StageSettings) -> [Self; 2] {
        [Self::exact(stage.clone()), Self::identified(stage.clone())]
    }

    /// The one of the two that a person names.
    pub fn new(knowledge: ModelKnowledge, stage: StageSettings) -> Self {
        match knowledge {
            ModelKnowledge::Exact => Self::exact(stage),
            ModelKnowledge::Identified => Self::identified(stage),
        }
    }

    /// Designs the best PID of each axis.
    ///
    /// # Errors
    /// A model that no PID keeps the bounds on.
    pub fn with_best_pid(mut self) -> Result<Self, DesignError> {
        self.best = Some(with_best_pid(&self.stage)?);
        Ok(self)
    }

    /// Laws that a command compares, the baseline first: the few of a glance, or all.
    pub fn configurations(&self, all: bool) -> Vec<Configuration> {
        match (self.commissioned, all) {
            (false, false) => Configuration::USUAL.to_vec(),
            (false, true) => Configuration::with_best_pid(),
            (true, false) => Configuration::OF_COMMISSIONED.to_vec(),
            (true, true) => Configuration::all_of_commissioned(),
        }
    }

    /// Returns the settings of a configuration. Gains of the best PID need [`Self::with_best_pid`].
    pub fn stage_of(&self, configuration: Configuration) -> StageSettings {
        let stage = match (configuration.gains, &self.best) {
            (Gains::BestPid, Some(best)) => best,
            (Gains::BestPid, None) => panic!("no best PID was designed"),
            (Gains::Settings | Gains::Commissioned, _) => &self.stage,
        };
        let mut stage = stage.clone();
        configuration.apply(&mut stage);
        stage
    }

    /// Gives the law the plant's own friction.
    pub fn know_friction(&mut self) {
        set_exact_friction(&mut self.stage, &self.truth);
    }
}

fn set_exact_friction(stage: &mut StageSettings, truth: &StageParameters) {
    for (axis, truth) in stage.axes.iter_mut().zip(&truth.axes) {
        axis.friction = with_all_models(
            truth.friction.map(|model| with_total_damping(model, truth)),
            truth.gms.clone(),
        );
    }
}

/// Viscous friction as a run at constant velocity shows it: sigma, and the linear damping B / A, which no motion
/// can distinguish from it.
fn with_total_damping(model: &StaticFriction, truth: &AxisParameters) -> StaticFriction {
    StaticFriction {
        viscous_v_s_per_mm: model.viscous_v_s_per_mm + truth.damping_per_s / truth.gain_mm_per_v_s2,
        ..*model
    }
}
