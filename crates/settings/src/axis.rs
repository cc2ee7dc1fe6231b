//! The settings of one axis. Ranges, defaults and meanings stand in [the table](super::leaves).

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

use super::feedback::FeedbackSettings;
use super::homing::HomingSettings;
use super::limits::LimitSettings;
use super::pulses::PulseSettings;
use super::serial_encoder::SerialSettings;
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::FrictionSettings;
use quadrant_law::learning::LearningSettings;

/// Everything one axis' control law is made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct AxisSettings {
    /// Encoder.
    pub encoder: EncoderSettings,
    /// Amplifier, and the converter that drives it.
    pub amplifier: AmplifierSettings,
    /// Feedback law and its parameters.
    pub feedback: FeedbackSettings,
    /// Friction models that the feedforward uses.
    pub friction: FrictionSettings,
    /// Friction and inertia feedforward.
    pub feedforward: FeedforwardSettings,
    /// Limits of motion, tracking error and encoder signal.
    pub limits: LimitSettings,
    /// Homing; none: the axis cannot be homed.
    #[serde(default)]
    pub homing: Option<HomingSettings>,
    /// Step and direction of another control; none: the axis follows no pulses.
    #[serde(default)]
    pub pulses: Option<PulseSettings>,
    /// The linear model of the axis, if known: with it, the nonlinear gain is held to the Popov bound.
    pub plant: Option<PlantModel>,
    /// True if the axis was commissioned: by the tool, or by the person who entered its settings.
    #[serde(default)]
    pub commissioned: bool,
}

/// An encoder: A, B and index with a hardware counter, or a serial one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct EncoderSettings {
    /// Length of one count, mm.
    pub resolution_mm: f64,
    /// Width of the hardware counter, or of a serial encoder's position, bits.
    pub counter_bits: u8,
    /// True if the counter runs backwards when the axis moves to larger positions.
    pub reversed: bool,
    /// Counts between neighbouring index pulses; none: the encoder has no index, or its spacing is not known.
    #[serde(default)]
    pub counts_per_index: Option<u32>,
    /// Distance, either way, by which an index pulse may miss its place, counts.
    #[serde(default = "index_tolerance_counts")]
    pub index_tolerance_counts: u32,
    /// Position that a serial encoder shows where the axis is at zero, mm; none: the axis is homed as one with A, B and index.
    #[serde(default)]
    pub offset_mm: Option<f64>,
    /// Serial encoder; none: A, B and index.
    #[serde(default)]
    pub serial: Option<SerialSettings>,
}

fn index_tolerance_counts() -> u32 {
    EncoderSettings::default().index_tolerance_counts
}

/// An amplifier input driven by a 16-bit converter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct AmplifierSettings {
    /// Voltage of the converter's largest code, V.
    pub full_scale_v: f64,
    /// Output limit, V.
    pub output_limit_v: f64,
    /// Voltage at which the motor gives no force, V; it is added to every output.
    pub offset_v: f64,
    /// True if a positive voltage moves the axis to smaller positions.
    pub reversed: bool,
    /// Output that the motor withstands indefinitely, V; from the output limit on, the load is not watched.
    #[serde(default = "continuous_v")]
    pub continuous_v: f64,
    /// Time for which the motor withstands the output limit, s.
    #[serde(default = "overload_s")]
    pub overload_s: f64,
    /// True if the output is the feedforward alone, to be added to the force of another drive.
    #[serde(default)]
    pub feedforward_alone: bool,
}

fn continuous_v() -> f64 {
    AmplifierSettings::default().continuous_v
}

fn overload_s() -> f64 {
    AmplifierSettings::default().overload_s
}

fn whole_range() -> f64 {
    FeedforwardSettings::default().range
}

/// The feedforward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct FeedforwardSettings {
    /// Friction models that act.
    #[tree(with = miniconf::leaf)]
    pub kind: FeedforwardKind,
    /// Shares of the models, and the inertia gain.
    pub gains: FeedforwardGains,
    /// Displacement over which friction is fed forward before it slides, over that of `friction`: springs are softer by it.
    #[serde(default = "whole_range")]
    pub range: f64,
    /// Look-ahead of the feedforward over the feedback's reference, s: the plant's delay.
    pub preview_s: f64,
    /// Largest velocity of motions to and fro on which no friction is fed forward, mm/s; from twice that on, all of it is.
    #[serde(default)]
    pub from_mm_s: f64,
    /// Longest stroke of motions to and fro on which no friction is fed forward, mm; from twice that on, all of it is.
    #[serde(default)]
    pub from_mm: f64,
    /// Learning of the friction's scale while the axis works; none: the scale stays 1.
    #[serde(default)]
    pub learning: Option<LearningSettings>,
    /// Cancelling of a cut's vibration at multiples of the spindle's frequency; none: nothing is cancelled.
    #[serde(default)]
    pub cancelling: Option<CancellingSettings>,
}
