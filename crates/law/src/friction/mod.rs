//! Friction models.
//!
//! Each is used twice, from one source: as feedforward in the control law, driven by the reference, and as the truth
//! in the simulated stage, driven by its motion. Friction is in volts at the amplifier input: force divided by the
//! motor constant.

pub mod bristle;
pub mod dahl;
mod direction;
pub mod gms;
pub mod lugre;
mod settings;
pub mod smoothed_gms;
pub mod stribeck;

pub use direction::{Direction, PerDirection};
pub use settings::FrictionSettings;
