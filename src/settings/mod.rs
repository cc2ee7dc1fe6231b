//! The tree a person edits, in SI units and millimetres.
//!
//! Settings are checked as a whole ([`StageSettings::validate`]) and built as a whole ([`StageSettings::build`]) by
//! slow code; the tick reads only what was built. An error names the field, the value and the allowed range. Units, ranges,
//! defaults and meanings of all settings stand in one table, [`leaves`].

mod axis;
mod build;
mod build_homing;
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
pub(crate) mod parts;
pub(crate) mod path;
pub mod presets;
mod stage;
pub mod tree;
mod validate;
pub(crate) mod value;

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
pub use stage::{PlanSettings, StageSettings};
pub use value::MAX_VALUE_BYTES;
