//! Machines and the client, tested on the simulated stage.
//!
//! One program of many modules: each would otherwise be linked with the whole library once more.

mod connected_axis;
mod host_motions;
mod hostile_link;
mod outputs_off;
mod simulated_machine;
