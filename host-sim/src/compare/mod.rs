//! The thesis' comparison: {PID, N-PID} x {no, static, GMS, combined feedforward} on a sine at three velocities.

pub mod comparison;
pub mod headlines;
pub mod honest;
pub mod page;
pub mod sine;
