//! The application without its registers: what the firmware's tasks do, and what passes between them.
//!
//! ```text
//!   control interrupt             supervising task            lowest task
//!   Control::tick, observe        Supervision::run            Server::poll  <-- bytes -->  a host
//!        |  snapshots ---------------->|  the latest ------------->|
//!        |                             |  events ----------------->|
//!        |<-------- commands ----------|                           |
//!        |<-------- commands, axes, motions, segments, selections, captures ---|
//!        |  samples, full captures, spare axes ----------------------------->|
//! ```
//!
//! Nothing is shared and nothing is locked: what passes from one half to the other is owned by one of them at a time,
//! and goes through bounded queues ([`Queues`]) that neither side waits for. Settings are built by the slow half into the one
//! spare [`Axis`](crate::law::axis::Axis), and exchanged whole, by reference.
//!
//! The firmware puts each piece into an RTIC task; a host runs them one after the other in one thread
//! (`quadrant_sim::console`), in the order in which the target would.

mod control;
mod journal;
pub mod last_words;
mod liveness;
mod queues;
pub mod rate_limiter;
mod server;
mod snapshot;
mod supervision;
pub mod supervisor;

pub use control::Control;

pub use crate::law::stage::Inputs;
pub use journal::{Journal, MOST_NEWS, News};
pub use liveness::Liveness;
pub use queues::{ControlEnds, Queues, ServerEnds};
pub use server::{After, Server, ServerParts, Vitals};
pub use snapshot::{AxisSnapshot, Meters, Snapshot};
pub use supervision::{Supervised, Supervision};

use crate::law::friction::gms::FIRMWARE_ELEMENTS;

/// An axis with the room that the firmware has.
pub type Axis<S> = crate::law::axis::Axis<S, FIRMWARE_ELEMENTS>;
