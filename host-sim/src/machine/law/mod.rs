//! The control law on the simulated stage, without firmware and link: the fastest machine, in every number type.
//!
//! - [`LawMachine`]: control tick and supervisor, in the order in which the target runs them;
//! - [`SimulatedTestAxis`]: one axis of the simulated stage under it, to be measured;
//! - [`LawStage`]: its three axes.

mod axis;
mod recorder;
mod stage;
mod watch;

pub use axis::SimulatedTestAxis;
pub use quadrant_simulation::law_machine::{LawMachine, Operator, TickInput};
pub use stage::LawStage;
