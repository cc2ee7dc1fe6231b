//! From an unknown axis to settings that the firmware runs: the whole chain, unattended.
//!
//! Known beforehand is what stands in a data sheet: the encoder's resolution, the amplifier's full scale,
//! limits. Everything else is measured on the axis, in an order in which each step makes the next one safe: an open-loop
//! square wave gives the acceleration per volt, that a slow controller, that the response at a constant velocity, that the
//! final PID, and that the friction.

pub mod bootstrap;
mod chain;
mod commissioned;
mod cross_check;
mod drift;
mod error;
mod guard;
mod linear_model;
mod models;
mod own_stage;
mod plan;
mod quiet_pid;
mod rest;
mod ringing;
mod velocity_mode;
pub mod verify;

pub use chain::{Watch, commission};
pub use commissioned::{CommissionSettings, Commissioned};
pub use cross_check::CrossCheck;
pub use drift::Drift;
pub use error::CommissionError;
pub use guard::{Guard, Run};
pub use models::Measurements;
pub use own_stage::{OwnStageError, commission_stage};
pub use plan::{Planned, plan, stray_mm};
pub use ringing::{Ringing, ringing};
