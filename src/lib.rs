//! Quadrant: servo control that removes friction's quadrant glitches from machine-tool axes.
//!
//! This crate is what the firmware does around the control law ([`quadrant_law`]) and its settings ([`quadrant_settings`])
//! without a register: it knows no operating system, no heap and no chip. The firmware (the binary of this package) stands on
//! it, and so does a machine that a host simulates whole (`quadrant_host`).
//!
//! - [`app`]: the work of the firmware's tasks, and the queues between them;
//! - [`store`]: settings in flash that no power cut loses;
//! - [`drivers`], [`hal`]: chips behind a bus, and the traits of a board.
//!
//! Frames and messages of the link are [`quadrant_link`].
#![no_std]
#![forbid(unsafe_code)]

pub mod app;
pub mod drivers;
pub mod hal;
pub mod store;
