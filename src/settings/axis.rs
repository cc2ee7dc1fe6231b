//! The settings of one axis.

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

use super::feedback::FeedbackSettings;
use super::homing::HomingSettings;
use super::limits::LimitSettings;
use crate::law::control::plant_model::PlantModel;
use crate::law::feedforward::{FeedforwardGains, FeedforwardKind};
use crate::law::friction::PerDirection;
use crate::law::friction::dahl::DahlParameters;
use crate::law::friction::gms::GmsParameters;
use crate::law::friction::lugre::LugreParameters;
use crate::law::friction::smoothed_gms::SmoothedGmsParameters;
use crate::law::friction::stribeck::StaticFriction;

/// Everything one axis' control law is made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct AxisSettings {
    /// The encoder.
    pub encoder: EncoderSettings,
    /// The amplifier and the converter that drives it.
    pub amplifier: AmplifierSettings,
    /// The feedback law.
    pub feedback: FeedbackSettings,
    /// The friction models that the feedforward uses.
    pub friction: FrictionSettings,
    /// The feedforward.
    pub feedforward: FeedforwardSettings,
    /// What the axis may do.
    pub limits: LimitSettings,
    /// How the axis finds out where it is; none: it cannot be homed.
    #[serde(default)]
    pub homing: Option<HomingSettings>,
    /// The linear model of the axis, if known: with it, the nonlinear gain is held to the Popov bound.
    pub plant: Option<PlantModel>,
}

/// An incremental encoder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct EncoderSettings {
    /// Length of one count, mm; 1e-6 to 1.
    pub resolution_mm: f64,
    /// Width of the hardware counter: 8 to 32.
    pub counter_bits: u8,
    /// The counter runs backwards when the axis moves to larger positions.
    pub reversed: bool,
    /// Counts between neighbouring index pulses, 16 to 1e9; none: the encoder has no index, or its spacing is not known.
    #[serde(default)]
    pub counts_per_index: Option<u32>,
    /// By how many counts an index pulse may be off; at most a quarter of their spacing.
    #[serde(default = "index_tolerance_counts")]
    pub index_tolerance_counts: u32,
}

fn index_tolerance_counts() -> u32 {
    EncoderSettings::default().index_tolerance_counts
}

/// An amplifier input driven by a 16-bit converter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct AmplifierSettings {
    /// Voltage of the converter's largest code, V; 0.1 to 20.
    pub full_scale_v: f64,
    /// Largest output, V; above zero, at most the full scale.
    pub output_limit_v: f64,
    /// Voltage at which the motor gives no force, V; it is added to every output. Within +-10 % of the full scale.
    pub offset_v: f64,
    /// A positive voltage moves the axis to smaller positions.
    pub reversed: bool,
}

/// The friction of an axis, as identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct FrictionSettings {
    /// The static model, for each sense of motion.
    pub sliding: PerDirection<StaticFriction>,
    /// The GMS model.
    pub gms: GmsParameters,
    /// What the smoothed GMS has beyond it.
    #[serde(default)]
    pub smoothed_gms: SmoothedGmsParameters,
    /// Dahl's model; needed by its kind of feedforward alone.
    #[serde(default)]
    pub dahl: Option<DahlParameters>,
    /// The LuGre model; needed by its kind of feedforward alone.
    #[serde(default)]
    pub lugre: Option<LugreParameters>,
}

impl FrictionSettings {
    /// The mean of both directions' breakaway levels, V.
    pub fn mean_breakaway_v(&self) -> f64 {
        let PerDirection { positive, negative } = &self.sliding;
        0.5 * (positive.curve.breakaway_v + negative.curve.breakaway_v)
    }
}

/// The feedforward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct FeedforwardSettings {
    /// Which friction models act.
    #[tree(with = miniconf::leaf)]
    pub kind: FeedforwardKind,
    /// How much of each.
    pub gains: FeedforwardGains,
    /// How far ahead of the feedback's reference the feedforward looks, s: the plant's delay. 0 to 31 control periods.
    pub preview_s: f64,
}
