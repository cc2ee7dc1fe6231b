//! Client of a machine's link: the host's side of the protocol.
//!
//! ```text
//!   commands --> Client --frames--> Transport --bytes--> a board, an emulated board, or a machine in this process
//! ```
//!
//! - [`Client`]: a session; requests are answered or fail in words, notices are kept until they are asked for;
//! - [`settings`]: leaf by leaf, and as the file that every other command reads;
//! - [`adopt`]: the friction that an axis has learnt, taken into the settings;
//! - [`samples`], [`columns`]: telemetry and captures, and their CSV files;
//! - [`set_points`]: a part program, streamed;
//! - [`settle`]: waiting for rest and for homing;
//! - [`test_axis`]: an axis of a connected machine, to be measured; [`Client`] is a [`Machine`](crate::machine::Machine);
//! - [`plot`]: curves in a terminal.
//!
//! Transports, and the machines in this process, are in [`machine`](crate::machine), which knows no client.
//! `docs/console.md` is the user's page.

pub mod adopt;
pub mod columns;
mod connected;
mod error;
mod flat;
mod interrupt;
pub mod plot;
pub mod samples;
mod session;
pub mod set_points;
pub mod settings;
pub mod settle;
pub mod test_axis;
mod timeout;

#[cfg(test)]
mod tests;

pub use error::{ClientError, with_reset};
pub use interrupt::Interrupt;
pub use session::Client;
