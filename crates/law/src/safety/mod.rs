//! The safety of the outputs: states, faults, and the monitors that find them.
//!
//! ```text
//!   Start --good inputs--> Disabled --Enable, good inputs--> Enabled --fault, Stop--> Stopping --at rest--> Faulted
//!                             ^                                 |                        |                    |
//!                             |<------------Disable-------------+------fault, Off--------+------------------->|
//!                             +------------------------------ResetFault---------------------------------------+
//! ```
//!
//! Nothing is enabled without a request, nor while an input is bad. A fault whose [`Reaction`] is to switch off does so
//! in the tick that finds it, before any other output is computed; one whose reaction is to stop brakes all axes under
//! control first. Either is latched until a person resets it, and the first one stays.
//!
//! | looks at | monitor | finds |
//! |----------|---------|-------|
//! | every reading | [`encoder`](crate::encoder), [`monitor`] | jump, both lines at once, stale, overspeed, silent, index |
//! | every output and reading | [`plausibility`] | encoder dead, or of the wrong sign |
//! | every reading, outputs off | `standstill` | an axis that moves and is not enabled |
//! | every output | [`overload`] | load of the motor, I²t |
//! | every error | [`monitor`] | following error |
//! | every fourth error | [`oscillation`] | feedforward that harms, hum, a loop that swings by itself |
//! | every reference | [`travel`], [`Switches`] | braking distance, limit switches |
//! | the board's inputs | [`Switches`] | emergency stop, amplifier fault, output mismatch |

mod brake;
mod fault;
pub mod monitor;
mod operation;
pub mod oscillation;
pub mod overload;
pub mod plausibility;
pub(crate) mod standstill;
mod state;
mod switches;
pub mod travel;

pub use brake::{Brake, BrakeState};
pub use fault::{EnableInterlock, Fault, FaultCode, Reaction};
pub use operation::{EnabledBy, HostNeeded, Operation, Station};
pub use state::SafetyState;
pub use switches::{AxisSwitches, Switches};
