//! The host's tools: the simulated XYZ stage, machines that the control law runs on, and what is done around a controller.
//!
//! - [`plant`]: the stage, simulated, with friction that the control law does not know exactly;
//! - [`machine`]: the control law alone, the firmware's application in this process, its image in QEMU, a board: one
//!   interface to measure them all;
//! - [`client`]: a session with a machine over the link;
//! - [`experiment`]: runs of a machine on a stage, and their scores;
//! - [`compare`], [`circle`], [`replay`]: the comparison, the circle test, recorded references and part programs, each with
//!   its tables and figures;
//! - [`commission`]: from an unknown axis to settings that the firmware runs;
//! - [`identify`]: from recordings to the parameters of an axis;
//! - [`design`]: margins, loop shaping, the choice of gains;
//! - [`record`]: recorded motions from CSV files, checked;
//! - [`gcode`]: part programs, and their motion;
//! - [`stage_file`]: a simulated stage of one's own, as TOML;
//! - [`settings_file`]: a stage's settings with their origin, as TOML; [`setting_value`]: their values, and what differs;
//! - [`settings_reference`]: the meaning of every setting, as a page;
//! - [`report`], [`pages`]: pages, tables and figures, and parts that several pages have.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

pub mod circle;
pub mod client;
pub mod commission;
pub mod compare;
pub mod design;
pub mod experiment;
pub mod gcode;
pub mod identify;
pub mod machine;
pub mod pages;
pub mod record;
pub mod replay;
pub use quadrant_report as report;
pub use quadrant_simulation::{plant, setting_value, settings_file, stage_file};
pub mod settings_reference;
