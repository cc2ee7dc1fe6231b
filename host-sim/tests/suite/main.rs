//! The simulated stage, and the control law on it.
//!
//! One program of many modules: each would otherwise be linked with the whole library once more.

mod given_run;
mod machine_motion;
mod one_axis;
mod plant;
mod plant_disturbances;
mod plant_drives;
mod plant_unchanged;
mod pulse_train;
