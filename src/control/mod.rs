//! Feedback: the laws, the model they are designed on, and the bound that keeps the nonlinear one stable.

pub mod npid;
pub mod pid;
pub mod plant_model;
pub mod popov;
