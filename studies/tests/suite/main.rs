//! The studies, tested on the simulated stage.

mod campaign;
mod chapter5;
mod command;
mod cuts;
mod friction_truths;
mod learning;
mod motor_test;
mod random_axes;
mod random_faults;
mod report_command;
mod robustness;
mod unplanned_motion;
mod wrong_model;
