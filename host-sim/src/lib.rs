//! The simulated XYZ stage and the experiments run on it.
#![forbid(unsafe_code)]
