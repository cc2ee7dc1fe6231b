//! The friction of an axis, as a person writes it.

use super::dahl::DahlParameters;
use super::direction::PerDirection;
use super::gms::GmsParameters;
use super::lugre::LugreParameters;
use super::smoothed_gms::SmoothedGmsParameters;
use super::stribeck::StaticFriction;

/// The friction of an axis, as identified.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct FrictionSettings {
    /// The static model, for each sense of motion.
    pub sliding: PerDirection<StaticFriction>,
    /// The elements of the GMS model.
    pub gms: GmsParameters,
    /// Parameters of the smoothed GMS beyond those of the GMS.
    #[cfg_attr(feature = "serde", serde(default))]
    pub smoothed_gms: SmoothedGmsParameters,
    /// Dahl's model; needed by its kind of feedforward alone.
    #[cfg_attr(feature = "serde", serde(default))]
    pub dahl: Option<DahlParameters>,
    /// The LuGre model; needed by its kind of feedforward alone.
    #[cfg_attr(feature = "serde", serde(default))]
    pub lugre: Option<LugreParameters>,
}

impl FrictionSettings {
    /// The static model and the GMS elements, the same in both senses of motion; no parameters of Dahl's and the LuGre
    /// model.
    pub fn new(sliding: StaticFriction, gms: GmsParameters) -> Self {
        Self {
            sliding: PerDirection::both(sliding),
            gms,
            smoothed_gms: SmoothedGmsParameters::DEFAULT,
            dahl: None,
            lugre: None,
        }
    }

    /// The same friction, over `factor` times the displacement before it slides.
    #[must_use]
    pub fn over_range(&self, factor: f64) -> Self {
        let mut softer = self.clone();
        for element in &mut softer.gms.elements {
            element.stiffness_v_per_mm /= factor;
        }
        if let Some(lugre) = &mut softer.lugre {
            lugre.stiffness_v_per_mm /= factor;
        }
        if let Some(dahl) = &mut softer.dahl {
            dahl.stiffness_v_per_mm /= factor;
        }
        softer
    }

    /// The mean of both directions' breakaway levels, V.
    pub fn mean_breakaway_v(&self) -> f64 {
        let PerDirection { positive, negative } = &self.sliding;
        0.5 * (positive.curve.breakaway_v + negative.curve.breakaway_v)
    }
}
