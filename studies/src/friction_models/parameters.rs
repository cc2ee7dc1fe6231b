//! The models that are compared, and the parameters of all of them on one axis.

use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_settings::AxisSettings;
use quadrant_sim::plant::{AxisParameters, Drive, FrictionParameters, Imperfections};
use quadrant_tune::identify::single_state::{presliding_range_mm, with_all_models};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// The static model: a level and nothing before sliding.
    Static,
    Dahl,
    Lugre,
    Gms,
    SmoothedGms,
}

impl Model {
    /// All models, in the order of their age.
    pub const ALL: [Self; 5] = [
        Self::Static,
        Self::Dahl,
        Self::Lugre,
        Self::Gms,
        Self::SmoothedGms,
    ];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dahl => "Dahl",
            Self::Lugre => "LuGre",
            Self::Gms => "GMS",
            Self::SmoothedGms => "S-GMS",
        }
    }
}

/// The parameters of all models of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// As settings hold them, with every model.
    pub friction: FrictionSettings,
    pub dahl: DahlParameters,
    pub lugre: LugreParameters,
    /// Acceleration of the free mass per volt, mm/(V s^2).
    pub gain_mm_per_v_s2: f64,
}

/// Reasons for which an axis' settings do not do.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParametersError {
    #[error(
        "the axis has no linear model (plant), and how its mass moves is part of the comparison; run `quadrant commission` first"
    )]
    NoPlant,
    /// Dahl and LuGre are neither given nor can they be fitted.
    #[error(
        "Dahl and LuGre cannot be fitted to the GMS elements: each needs a positive stiffness and weight; identify them again, or give \
         friction.dahl and friction.lugre"
    )]
    NotFitted,
}

impl Parameters {
    /// Those of an axis; Dahl and LuGre are fitted to its GMS elements if the settings do not have them.
    ///
    /// # Errors
    /// No linear model, or elements that nothing can be fitted to.
    pub fn of(settings: &AxisSettings) -> Result<Self, ParametersError> {
        let plant = settings.plant.ok_or(ParametersError::NoPlant)?;
        let mut friction = settings.friction.clone();
        let fitted = with_all_models(friction.sliding, friction.gms.clone());
        let (Some(dahl), Some(lugre)) = (
            friction.dahl.or(fitted.dahl),
            friction.lugre.or(fitted.lugre),
        ) else {
            return Err(ParametersError::NotFitted);
        };
        (friction.dahl, friction.lugre) = (Some(dahl), Some(lugre));
        Ok(Self {
            friction,
            dahl,
            lugre,
            gain_mm_per_v_s2: plant.gain_mm_per_v_s2,
        })
    }

    /// The pre-sliding range, mm.
    pub fn range_mm(&self) -> f64 {
        presliding_range_mm(&self.friction.gms, self.friction.mean_breakaway_v())
    }

    /// A free mass with a model's friction and nothing else: no delay, no noise, all damping in the friction.
    fn axis(&self, model: FrictionParameters) -> AxisParameters {
        AxisParameters {
            gain_mm_per_v_s2: self.gain_mm_per_v_s2,
            damping_per_s: 0.0,
            stiffness_per_s2: 0.0,
            delay_s: 0.0,
            friction: self.friction.sliding,
            gms: self.friction.gms.clone(),
            model,
            drive: Drive::BallScrew,
            resolution_mm: 1e-6,
            full_scale_v: 10.0,
            imperfections: Imperfections::default(),
        }
    }

    /// The model as a simulated axis' truth; the static model, which has no state, cannot be one.
    pub(super) fn truth(&self, model: Model) -> Option<AxisParameters> {
        let model = match model {
            Model::Static => return None,
            Model::Dahl => FrictionParameters::Dahl(self.dahl),
            Model::Lugre => FrictionParameters::Lugre(self.lugre),
            Model::Gms => FrictionParameters::Gms,
            Model::SmoothedGms => FrictionParameters::Smoothed(self.friction.smoothed_gms),
        };
        Some(self.axis(model))
    }
}
