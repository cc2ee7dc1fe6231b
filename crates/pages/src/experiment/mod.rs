//! Configurations of law and stage that runs compare, and what repeated runs gave: what comparison, circle, replay and the
//! studies share.

pub mod configuration;
pub mod run_configuration;
pub mod statistic;
