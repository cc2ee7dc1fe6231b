//! A bench for faults: the firmware's tasks in this process, on hardware that fails.
//!
//! - [`tasks`]: control interrupt, supervising task and server, each interrupted by those above it;
//! - [`plant`]: an x axis that moves as its output makes it, and an encoder that dies;
//! - [`lone`]: one axis of the law on that plant, without a stage;
//! - [`flash`]: two sectors that lose their power in the middle of things, and wear;
//! - [`noise`]: the same random numbers on every machine.
//!
//! The law's tests and the campaign of random faults (`quadrant-studies faults`) run on it.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

#[cfg(feature = "tasks")]
pub mod flash;
pub mod lone;
pub mod noise;
pub mod plant;
#[cfg(feature = "tasks")]
pub mod tasks;
