//! The simulated XYZ stage and the experiments run on it.
#![forbid(unsafe_code)]
pub mod design;
pub mod experiment;
pub mod machine;
pub mod plant;
pub mod presentation;
pub mod record;
pub mod report;
