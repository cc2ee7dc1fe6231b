//! The thesis' chapters 3 to 5 and its headline figures on the simulated stage.

pub mod chapter3;
pub mod chapter4;
pub mod chapter5;
pub mod headline;
pub mod imperfections;
mod numbers;
