//! Experiments on the simulated stage, and what they measure.

pub mod chapter5;
pub mod circle;
pub mod comparison;
pub mod compensator;
pub mod friction_models;
pub mod imperfections;
pub mod laws;
pub mod metrics;
pub mod numerics;
pub mod outputs;
pub mod part_program;
pub mod recorded;
pub mod robustness;
mod run;
pub mod statistic;
pub mod thesis;
mod trial;
pub mod validation;

pub use run::{AxisTrace, RunError, run};
pub use trial::{Trial, TrialOutcome, try_three};
