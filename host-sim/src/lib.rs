//! The simulated XYZ stage, and what is done around a controller: experiments, comparison, design.
//!
//! - [`plant`]: the stage, simulated, with friction that the control law does not know exactly;
//! - [`machine`]: the control law alone, the firmware's application in this process, its image in QEMU, a board: one
//!   interface to measure them all;
//! - [`experiment`]: runs of a machine on a stage, and what they score;
//! - [`report_parts`]: what `quadrant report` computes, part by part, and keeps;
//! - [`presentation`]: their tables and pages, made with [`report`];
//! - [`record`]: recorded motions from CSV files, checked;
//! - [`program`]: part programs in G-code, and their motion;
//! - [`settings_file`]: a stage's settings with their origin, as TOML;
//! - [`settings_reference`]: what every setting means, as a page;
//! - [`client`]: a session with a machine over the link;
//! - [`identify`]: from recordings to the parameters of an axis;
//! - [`design`]: margins, loop shaping, the choice of gains.
#![forbid(unsafe_code)]

pub mod client;
pub mod commission;
pub mod design;
pub mod experiment;
pub mod identify;
pub mod machine;
pub mod plant;
pub mod presentation;
pub mod program;
pub mod record;
pub use quadrant_report as report;
pub mod report_parts;
#[doc(hidden)]
pub mod rig;
pub mod settings_file;
pub mod settings_reference;

// Names that moved, until every caller has the new ones.
#[doc(hidden)]
pub use client as console;
#[doc(hidden)]
pub use machine::benchmark_job as scenario;
#[cfg(unix)]
#[doc(hidden)]
pub use machine::{emulated as emulated_machine, emulator};
/// The simulated machine under its old name.
#[doc(hidden)]
pub mod simulated_machine {
    pub use crate::machine::application::{Running, Start};
    pub use crate::machine::memory_flash::MemoryFlash;
    pub use crate::machine::simulated::SimulatedMachine;
}
