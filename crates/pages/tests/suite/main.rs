//! Runs on the simulated stage, and what is evaluated of them.
//!
//! One program of many modules: each would otherwise be linked with the whole library once more.

mod circle;
mod experiments;
mod identified_stage;
