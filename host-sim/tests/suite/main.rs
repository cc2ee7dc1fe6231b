//! The host library, tested against the simulated stage.
//!
//! One program of many modules: each would otherwise be linked with the whole library once more.

mod best_pid;
mod circle;
mod commission_any_axis;
mod connected_axis;
mod default_gains;
mod design_npid;
mod design_pid;
mod experiments;
mod host_motions;
mod hostile_link;
mod identified_stage;
mod identify_frf;
mod identify_motion;
mod identify_motor_constant;
mod identify_nctf;
mod identify_plant;
mod identify_revise;
mod identify_static_friction;
mod identify_virgin_curve;
mod machine_motion;
mod npid_lasting_error;
mod one_axis;
mod part_program;
mod plant;
mod plant_disturbances;
mod plant_drives;
mod plant_unchanged;
mod record_emps;
mod record_experiment;
mod record_refusals;
mod record_trace;
mod simulated_machine;
mod test_axis;
