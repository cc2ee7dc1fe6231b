//! Building the firmware's images, and reading them: what the chores share with the tests that run on the images.
#![forbid(unsafe_code)]

pub mod call_graph;
pub mod command;
pub mod golden;
pub mod image;
pub mod listing;
pub mod prove;
pub mod toolchain;
