//! The number type of the control law.
//!
//! The law is written once, over [`Scalar`], and runs on three number types: `f32` on a target with a floating-point
//! unit, [`Fixed`] on one without, and `f64` on the host, where it is the reference that numeric error is measured
//! against and the arithmetic of the simulated plant.
//!
//! Signals are `S`, a value together with a [`Quantity`] that the code knows and the number does not carry. For the
//! floats the quantity changes nothing. For [`Fixed`] it picks the binary point. A constant that multiplies a signal
//! is an `S::Gain`, made at settings time from its value in `f64` and the quantities on both sides, so that no
//! format is converted, and nothing is divided, in the tick.
//!
//! Every operation saturates, none wraps, and none panics.

mod fixed;
mod float;
mod number;
mod quantity;

pub use fixed::{Fixed, FixedGain};
pub use float::CompensatedSum;
pub(crate) use number::OCTAVE_INTERVAL_BITS;
pub use number::{OctaveStart, Scalar};
pub use quantity::Quantity;
