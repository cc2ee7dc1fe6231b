//! Machines: everything that runs the control law on a stage, and the ways to it.
//!
//! ```text
//!   identify, commission --> Machine --> TestAxis
//!                              |
//!        +---------------------+----------------------+
//!        | LawStage                                   | client::Client
//!        | the law alone, without firmware            | the link's protocol, over a Transport:
//!        |                                            |   Loopback        SerialTransport, TcpTransport
//!        |                                            |   |            |         |
//!   SimulatedStage <-- SimulatedMachine --------------+   |            |         a board
//!   (crate::plant)     the firmware's application         |            |
//!        ^-------------------------------- EmulatedMachine: its image in QEMU
//! ```
//!
//! - [`Machine`], [`TestAxis`]: a machine and an axis that are measured, of any kind;
//! - [`law`]: the control law and the supervisor alone;
//! - [`simulated`], [`application`], [`memory_flash`]: the firmware's application in this process;
//! - [`emulated`], [`emulator`] (feature `emulated`): the firmware's image in QEMU; [`benchmark_job`]: the motion that it is
//!   counted with;
//! - [`Transport`], [`SerialTransport`], [`TcpTransport`], [`Loopback`]: bytes to a machine and back; `claim`: one program
//!   at a time; [`Shared`]: others may look;
//! - [`simulated_io`]: fault injection at machines that are not real: inputs, supply, log.
//!
//! Nothing here knows the client: [`client`](crate::client) is built on this.

pub mod application;
mod approach;
pub mod benchmark_job;
mod claim;
#[cfg(all(unix, feature = "emulated"))]
pub mod emulated;
#[cfg(all(unix, feature = "emulated"))]
mod emulated_link;
#[cfg(all(unix, feature = "emulated"))]
pub mod emulator;
mod error;
mod flash_file;
mod interface;
mod journal;
pub mod law;
mod loopback;
pub mod memory_flash;
mod serial;
mod shared;
pub mod simulated;
pub mod simulated_io;
mod simulated_link;
mod stage_setup;
mod stream;
mod tcp;
mod test_axis;
mod timing;
mod transport;
mod travel;

pub use approach::{approach, approach_from, approach_mm_s};
#[cfg(all(unix, feature = "emulated"))]
pub use emulated_link::EmulatedLink;
pub use error::MachineError;
pub use interface::Machine;
pub use journal::{Begun, Journal};
pub use law::{LawMachine, LawStage, Operator, SimulatedTestAxis};
pub use loopback::{Loopback, SimulatedPeer};
pub use serial::{BAUD, SerialTransport, serial_ports};
pub use shared::{MOST_VIEWERS, PASSED_ON, Shared, VIEWER_IDS};
pub use simulated_io::SimulatedIo;
pub use simulated_link::SimulatedLink;
pub use stage_setup::{BUILT_IN_STAGE, StageSetup, enter_limits};
pub use tcp::TcpTransport;
pub use test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, Sides, TestAxis, open_loop_mm, room_mm, span_mm,
    usable_mm,
};
pub use transport::{Transport, encoded};
pub use travel::Travel;
