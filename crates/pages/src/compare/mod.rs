//! The thesis' comparison: {PID, N-PID} x {no, static, GMS, combined feedforward} on a sine at three velocities, against the best
//! PID.

pub mod comparison;
pub mod glance;
pub mod headlines;
pub mod page;
mod reversal;
pub mod sine;
pub mod subject;
