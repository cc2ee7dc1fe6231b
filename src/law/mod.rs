//! The control law: from an encoder's counts to a converter's word, and everything that one tick reads and writes.
//!
//! Pure: no register, no operating system, no heap, no clock. Nothing in this folder imports settings, link or
//! application; a test holds that. Each module is also reachable from the root of the crate: `quadrant::axis`.

pub mod axis;
pub mod control;
pub(crate) mod course;
pub mod decimal;
pub mod encoder;
pub mod feedforward;
pub mod friction;
pub mod homing;
pub mod injection;
pub mod reference;
pub(crate) mod rounding;
pub mod safety;
pub mod scalar;
pub mod stage;
pub mod table;
pub mod telemetry;
pub mod units;
