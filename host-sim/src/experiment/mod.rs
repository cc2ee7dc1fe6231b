//! Experiments on the simulated stage, and what they measure.

pub mod circle;
pub mod comparison;
pub mod compensator;
pub mod metrics;
pub mod numerics;
pub mod part_program;
pub mod recorded;
mod run;
pub mod thesis;
pub mod validation;

pub use run::{AxisTrace, RunError, run};
