//! QEMU with the firmware in it, and the memory through which a host plays its stage
//! ([`quadrant_lockstep`] is its map).

mod backoff;
mod error;
mod lockstep;
mod log;
mod memory;
mod process;
mod program;
mod record;

pub use self::backoff::Backoff;
pub use self::error::EmulatorError;
pub use self::lockstep::Lockstep;
pub use self::memory::Memory;
pub use self::process::{Clock, Emulator, Listener, command_line};
pub use self::program::Program;
pub use self::record::{input_of, record_of};
