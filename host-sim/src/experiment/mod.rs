//! Experiments on the simulated stage, and what they measure.

pub mod circle;
pub mod comparison;
pub mod compensator;
pub mod metrics;
pub mod numerics;
pub mod recorded;
pub mod robustness;
mod run;
pub mod thesis;
pub mod validation;

pub use run::{AxisTrace, run};
