//! From measurements to parameters: the thesis' chapter 3.
//!
//! An experiment is run on a [`TestAxis`](crate::test_axis::TestAxis), or its recording read from a file; everything here works on
//! [`Recording`](crate::record::Recording)s and knows nothing of where they come from.
//!
//! - [`at_rest`]: the response of an axis at rest, at several amplitudes;
//! - [`characteristic`]: the trajectory along which an axis comes to rest by itself, for NCTF;
//! - [`excitation`]: voltages that make an axis show its response;
//! - [`frf`]: that response, measured;
//! - [`fit`]: bounded, robust nonlinear least squares with standard errors, which the steps share;
//! - [`measured_table`]: frequency responses and friction maps as CSV;
//! - [`mode`]: a structural mode, a resonance of the drive train;
//! - [`motion`]: inertia and friction from an ordinary motion record;
//! - [`motor_constant`]: acceleration per volt from a square wave;
//! - [`plant`]: the linear model of a response;
//! - [`response`]: measured frequency responses, in memory and as CSV;
//! - [`revise`]: the linear model once friction stands beside it;
//! - [`setting`]: the error of a step's own setting that is out of range;
//! - [`single_state`]: Dahl and LuGre, fitted to a GMS model;
//! - [`static_friction`]: the friction-velocity map and its model;
//! - [`virgin_curve`]: pre-sliding friction, the GMS model.

pub mod at_rest;
pub mod characteristic;
pub mod excitation;
pub mod fit;
pub mod frf;
mod latest;
pub mod measured_table;
pub mod mode;
pub mod motion;
pub mod motor_constant;
pub mod plant;
pub mod response;
pub mod revise;
pub mod setting;
pub mod single_state;
pub mod static_friction;
pub mod virgin_curve;
