//! The studies, tested on the simulated stage.

mod chapter5;
mod command;
mod cuts;
mod friction_models;
mod laws;
mod learning;
mod random_axes;
mod random_faults;
mod report_command;
mod report_parts;
mod robustness;
mod robustness_command;
mod unplanned_motion;
