//! Quadrant: servo control that removes friction's quadrant glitches from machine-tool axes.
//!
//! This crate is what the firmware does around the control law ([`quadrant_law`]) and its settings ([`quadrant_settings`])
//! without a register: it knows no operating system, no heap and no chip. The firmware (the binary of this package) stands on
//! it, and so does a machine that a host simulates whole (`quadrant_host`).
//!
//! - [`app`]: the work of the firmware's tasks, and the queues between them;
//! - [`store`]: settings in flash that no power cut loses;
//! - [`drivers`], [`hal`]: chips behind a bus, and the traits of a board;
//! - [`link`]: frames and messages, a crate of their own;
//! - [`lockstep`]: the channel between the emulated board and the host that simulates its stage.
#![no_std]
#![forbid(unsafe_code)]

pub mod app;
pub mod drivers;
pub mod hal;
pub mod lockstep;
pub mod store;

/// The messages of the link, a crate of their own.
pub use quadrant_link as link;
