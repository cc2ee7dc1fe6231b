//! The control law on the host: every part against its definition, and the whole tick against its promises.

mod anti_windup;
mod axis_limits;
mod bumpless;
mod common;
mod encoder;
mod every_parameter_counts;
mod feedforward;
mod fixed_arithmetic;
mod friction_gms;
mod friction_gms_memory;
mod friction_static;
mod lockstep_records;
mod nonlinear_gain;
mod number_types;
mod pid;
mod reference_harmonic;
mod reference_move;
mod reference_recorded;
mod safety;
mod settings;
mod settings_cross_checks;
mod settings_plan;
mod settings_storage;
mod supervisor;
