//! Experiments on the simulated stage, and what they measure.

pub mod chapter5;
pub mod circle;
pub mod comparison;
pub mod compensator;
pub mod imperfections;
pub mod metrics;
pub mod numerics;
pub mod recorded;
mod run;
pub mod thesis;
pub mod validation;

pub use run::{AxisTrace, run};
