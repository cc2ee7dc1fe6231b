//! The settings of a stage: the tree a person edits, in SI units and millimetres, and whatever is slow about them.
//!
//! Settings are checked as a whole ([`StageSettings::validate`]) and built as a whole ([`StageSettings::build`]) by
//! slow code; the tick reads only what was built. An error names the field, the value and the allowed range. Units, ranges,
//! defaults and meanings of all settings stand in one table, [`leaves`].
//!
//! [`popov`] proves the bound of the nonlinear gain, [`cancelling`] the margin of each cancelled frequency, on the
//! responses of [`response`]; [`stream_planner`] checks set points tick by tick before the law gets them.

#![no_std]
#![forbid(unsafe_code)]

mod axis;
mod build;
mod build_homing;
pub mod cancelling;
mod defaults;
mod destination;
pub mod draft;
mod error;
mod feedback;
mod homing;
mod injection;
pub mod leaves;
mod limits;
mod operation;
pub mod parts;
pub mod path;
pub mod popov;
pub mod presets;
mod pulses;
pub mod response;
mod serial_encoder;
mod stage;
pub mod stream_planner;
pub mod tree;
mod validate;
pub mod value;

pub use axis::{AmplifierSettings, AxisSettings, EncoderSettings, FeedforwardSettings};
pub use destination::{MoveError, MoveFlaw, reach_mm};
pub use error::{Reason, SettingsError};
pub use feedback::FeedbackSettings;
pub use homing::{HomeSwitch, HomingSettings};
pub use injection::InjectionSettings;
pub use limits::{LimitSettings, TravelSettings};
pub use operation::{
    BrakeSettings, EmergencyReaction, LossReaction, OperationSettings, StreamingSettings,
};
pub use pulses::PulseSettings;
pub use serial_encoder::{CheckBit, SerialProtocol, SerialSettings};
pub use stage::{Job, PlanSettings, StageSettings};
pub use value::MAX_VALUE_BYTES;
