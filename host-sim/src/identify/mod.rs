//! From measurements to parameters: the thesis' chapter 3.
//!
//! An experiment is run on a [`Rig`](crate::rig::Rig), or its recording read from a file; everything here works on
//! [`Recording`](crate::rig::Recording)s and knows nothing of where they come from.
//!
//! - [`fit`]: bounded, robust nonlinear least squares with standard errors, which the steps share;
//! - [`response`]: measured frequency responses, in memory and as CSV;
//! - [`revise`]: the linear model once friction stands beside it.

pub mod fit;
pub mod response;
pub mod revise;
