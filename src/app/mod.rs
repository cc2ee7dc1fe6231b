//! The application without registers: the work of the firmware's tasks, and the queues between them.
//!
//! ```text
//!   control interrupt             supervising task            lowest task
//!   Control::tick, observe        Intake::run <-- bytes       Server::poll --> bytes
//!                                 Supervision::run
//!        |  snapshots ---------------->|  the latest ------------->|
//!        |                             |  bytes, events ---------->|
//!        |<-- commands, glitch readings, number of valid requests -|
//!        |<-------- orders, axes, plans, segments, selections, captures ---|
//!        |  samples, full captures, back buffers --------------------------->|
//! ```
//!
//! What passes from one half to the other is owned by one of them at a time, and goes through bounded queues ([`Queues`])
//! that neither side waits for; beside them there are counters, each with one writer. **A decision is taken on the state of
//! now, by the one who acts on it**: the control interrupt. The others judge an older state to inform a person early. Settings are built by the slow half into the one
//! [`Axis`](quadrant_law::axis::Axis) that the law does not use, the back buffer, and swapped whole, by reference.
//!
//! The firmware puts each piece into an RTIC task; a host runs them one after the other in one thread
//! (`quadrant_host::machine`), in the order in which the target would.

pub mod capture;
mod change_detector;
mod control;
pub mod crash_record;
mod enabling;
pub mod friction_monitor;
pub mod glitch_monitor;
mod host_need;
mod intake;
mod liveness;
pub mod log_ring;
pub mod oscillation_report;
mod pulse_lead;
mod queues;
pub mod rate_limiter;
mod server;
mod snapshot;
pub mod start_record;
mod supervision;
pub mod telemetry;
mod wire;

pub use change_detector::{ChangeDetector, MAX_STATE_CHANGES, StateChange};
pub use control::Control;
pub use enabling::Enabling;

pub use host_need::link_timeout_ticks;
pub use intake::{Intake, Received};
pub use liveness::Liveness;
pub use pulse_lead::PulseLead;
pub use quadrant_law::stage::Inputs;
pub use queues::{ControlEnds, IntakeEnds, Queues, ServerEnds};
pub use server::{Poll, Server, ServerParts, ServerStatistics};
pub use snapshot::{AxisSnapshot, Snapshot, TimingStatistics};
pub use supervision::{Supervised, Supervision};
pub use wire::Translated;

use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;

/// An axis with the room that the firmware has.
pub type Axis<S> = quadrant_law::axis::Axis<S, FIRMWARE_ELEMENTS>;
