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
//!   (quadrant-sim)     the firmware's application         |            |
//!        ^-------------------------------- EmulatedMachine: its image in QEMU
//! ```
//!
//! - [`Machine`]: a machine of any kind, whose axes are measured; [`LawStage`]: the control law and the supervisor alone;
//! - [`simulated`], [`application`], [`memory_flash`]: the firmware's application in this process;
//! - [`emulated`], [`emulator`] (feature `emulated`): the firmware's image in QEMU;
//! - [`Transport`], [`SerialTransport`], [`TcpTransport`], [`Loopback`]: bytes to a machine and back; `claim`: one program
//!   at a time; [`Shared`]: others may look;
//! - [`simulated_io`]: fault injection at machines that are not real: inputs, supply, log.
//!
//! Nothing here knows the client: [`client`](crate::client) is built on this.

pub mod application;
mod claim;
#[cfg(all(unix, feature = "emulated"))]
pub mod emulated;
#[cfg(all(unix, feature = "emulated"))]
mod emulated_link;
#[cfg(all(unix, feature = "emulated"))]
pub mod emulator;
mod flash_file;
mod interface;
mod journal;
mod law_stage;
mod loopback;
pub mod memory_flash;
mod serial;
mod shared;
pub mod simulated;
pub mod simulated_io;
mod simulated_link;
mod stream;
mod tcp;
mod timing;
mod transport;

#[cfg(all(unix, feature = "emulated"))]
pub use emulated_link::EmulatedLink;
pub use flash_file::FlashFile;
pub use interface::Machine;
pub use journal::{Begun, Journal};
pub use law_stage::LawStage;
pub use loopback::{Loopback, SimulatedPeer};
pub use serial::{BAUD, SerialTransport, serial_ports};
pub use shared::{MOST_VIEWERS, PASSED_ON, Shared, VIEWER_IDS};
pub use simulated_io::SimulatedIo;
pub use simulated_link::SimulatedLink;
pub use tcp::TcpTransport;
pub use transport::{Transport, encoded};
