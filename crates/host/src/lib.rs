//! The host's side of a controller.
//!
//! - [`machine`]: the control law alone, the firmware's application in this process, its image in QEMU, a board: one
//!   interface to measure them all;
//! - [`client`]: a session with a machine over the link;
//! - [`log`](mod@log) (feature `log`): the firmware's log, decoded.
//!
//! It knows no pages and no command line.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

pub mod client;
#[cfg(feature = "log")]
pub mod log;
pub mod machine;
