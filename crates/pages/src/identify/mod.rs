//! Tables and figures of the identification's steps.

mod bode;
pub mod characteristic;
pub mod friction;
pub mod linear;
pub mod motion;
pub mod motor_constant;
pub mod revise;
