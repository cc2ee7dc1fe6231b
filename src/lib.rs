//! Quadrant: servo control that removes friction's quadrant glitches.
#![no_std]
#![forbid(unsafe_code)]

pub mod axis;
pub mod control;
pub mod encoder;
pub mod feedforward;
pub mod friction;
pub mod hal;
pub mod link;
pub mod reference;
pub mod safety;
pub mod scalar;
pub mod settings;
pub mod stage;
pub mod supervisor;
pub mod table;
pub mod telemetry;
pub mod units;
