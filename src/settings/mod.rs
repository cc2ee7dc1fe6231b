//! The tree a person edits, in SI units and millimetres.
//!
//! Settings are checked as a whole ([`StageSettings::validate`]) and built as a whole ([`StageSettings::build`]) by
//! slow code; the tick reads only what was built. An error names the field, the value and what is allowed.

mod build;
mod defaults;
mod destination;
pub mod draft;
mod error;
mod feedback;
mod homing;
mod injection;
pub mod leaves;
mod limits;
pub(crate) mod parts;
pub mod tree;
mod validate;
pub(crate) mod value;

pub use defaults::{x_axis, y_axis, z_axis};
pub use destination::{MoveError, MoveFlaw};
pub use error::{Reason, SettingsError};
pub use homing::{HomeSwitch, HomingSettings};
pub use injection::InjectionSettings;
pub use limits::{LimitSettings, LossReaction, StreamingSettings, TravelSettings};
pub use value::MAX_VALUE_BYTES;

pub use crate::law::friction::FrictionSettings;

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

use crate::law::control::cascade::CascadeGains;
use crate::law::control::feedback::LawKind;
use crate::law::control::nctf::NctfGains;
use crate::law::control::npid::NonlinearGain;
use crate::law::control::pid::PidGains;
use crate::law::control::plant_model::PlantModel;
use crate::law::control::schedule::GainSchedule;
use crate::law::control::sliding_mode::SlidingModeGains;
use crate::law::feedforward::{FeedforwardGains, FeedforwardKind};
use crate::law::reference::MotionSettings;

/// Everything the stage's control law is made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct StageSettings {
    /// Control rate, Hz; 1000 to 100 000.
    pub rate_hz: f64,
    /// What happens when set points of a stream no longer come.
    #[serde(default)]
    pub streaming: StreamingSettings,
    /// The axes.
    pub axes: [AxisSettings; 3],
}

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
    4
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

/// The feedback law, and the parameters of every law that the axis has some for: the law can be changed without losing
/// them, but only to one that has its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct FeedbackSettings {
    /// The law that acts.
    #[tree(with = miniconf::leaf)]
    pub law: LawKind,
    /// The integral of any law stays within plus and minus this, V; above zero, at most the output limit.
    pub integral_limit_v: f64,
    /// Time constant with which the offset of a bumpless change of settings fades, s; 0.001 to 10.
    pub transfer_s: f64,
    /// The gains of PD, PID, N-PID and of the scheduled PID; the derivative's filter is every law's.
    pub pid: PidGains,
    /// The nonlinear gain that makes the PID an N-PID.
    pub nonlinear: Option<NonlinearGain>,
    /// The schedule of the scheduled PID: shares of the PID's gains over the reference's speed.
    pub schedule: Option<GainSchedule>,
    /// The cascade.
    pub cascade: Option<CascadeGains>,
    /// Sliding mode.
    pub sliding_mode: Option<SlidingModeGains>,
    /// NCTF.
    pub nctf: Option<NctfGains>,
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

/// The motions of the three axes, started together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanSettings {
    /// One motion an axis.
    pub motions: [MotionSettings; 3],
}
