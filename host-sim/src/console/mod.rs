//! The host's side of the link: what `quadrant connect` is made of.
//!
//! ```text
//!   commands --> Client --frames--> Transport --bytes--> a board, an emulated board, or a machine in this process
//! ```
//!
//! - [`Transport`]: bytes both ways, and the clock by which they are waited for: [`SerialTransport`], [`TcpTransport`],
//!   [`InProcess`], of which [`SimulatedLink`] and [`EmulatedLink`] are two;
//! - [`hands`]: what a person does at a machine beside the link;
//! - [`Client`]: a session; requests are answered or fail in words, notices are kept until someone asks;
//! - [`settings`]: leaf by leaf, and as the file that every other command reads;
//! - [`samples`], [`columns`]: telemetry and captures, and their CSV files;
//! - [`set_points`]: a part program, streamed;
//! - [`settle`]: waiting for the machine;
//! - [`plot`]: curves in a terminal;
//! - [`rig`]: a connected axis that experiments are run on.
//!
//! `docs/console.md` is the page for those who use it.

mod client;
pub mod columns;
#[cfg(unix)]
mod emulated;
mod error;
mod flash_file;
pub mod hands;
mod patience;
pub mod plot;
pub mod rig;
pub mod samples;
pub mod set_points;
pub mod settings;
pub mod settle;
mod simulated;
mod transport;

#[cfg(test)]
mod tests;

pub use client::Client;
#[cfg(unix)]
pub use emulated::EmulatedLink;
pub use error::{ClientError, with_reset};
pub use simulated::SimulatedLink;
pub use transport::{BAUD, Exchange, InProcess, SerialTransport, TcpTransport, Transport};
