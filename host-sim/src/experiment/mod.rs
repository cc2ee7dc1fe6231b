//! Runs of a machine on the simulated stage, and their scores: what comparison, circle, replay and the studies share.

pub mod configuration;
pub mod metrics;
pub mod run;
pub mod run_configuration;
pub mod sine_test;
pub mod statistic;
