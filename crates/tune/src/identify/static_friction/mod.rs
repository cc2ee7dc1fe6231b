//! The static friction model from runs at constant velocity (thesis, Figs 3.8-3.10; Table 3.2).
//!
//! At constant velocity the voltage is the friction: `s(v) sgn(v) + (sigma + B / A) v - offset`. Two things cannot be separated
//! by it, and each has its convention here:
//!
//! - *sigma and B / A*: the slope at high velocity is their sum. The settings' viscous friction is that sum; the linear
//!   model's B, which is the same damping seen by a controller, is not fed forward.
//! - *the amplifier's offset and a friction that differs between the directions*: each direction's levels are as seen at
//!   the amplifier's input, offset included. Their mean is free of it.

mod fit;
mod map;
mod measure;

pub use fit::{DirectionFit, Exponent, FrictionFit, FrictionFitError, KnownViscous, fit_map};
pub use map::{FrictionMap, FrictionRun};
pub use measure::{ShortRuns, StaticFrictionError, StaticFrictionSettings, measure};
