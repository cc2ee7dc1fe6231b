//! Identification, design and commissioning, tested on the simulated stage.
//!
//! One program of many modules: each would otherwise be linked with the whole library once more.

mod best_pid;
mod commission_any_axis;
mod cross_check;
mod default_gains;
mod design_npid;
mod design_pid;
mod design_time_domain;
mod identify_frf;
mod identify_motion;
mod identify_motor_constant;
mod identify_nctf;
mod identify_plant;
mod identify_revise;
mod identify_static_friction;
mod identify_virgin_curve;
mod npid_lasting_error;
mod printed_margins;
mod record_emps;
mod record_experiment;
mod record_refusals;
mod record_trace;
mod test_axis;
mod velocity_drive;
