//! An axis that is measured: what identification and commissioning ask of a machine.
//!
//! - [`TestAxis`]: an axis of any kind, on which an [`Experiment`] is performed; [`Travel`]: the room that it has;
//! - [`approach()`], [`approach_from`]: to a position between experiments;
//! - [`SimulatedTestAxis`]: an axis of the simulated stage under the control law alone.

mod approach;
mod axis;
mod error;
mod simulated;
mod travel;

pub use approach::{approach, approach_from, approach_mm_s};
pub use axis::{
    AxisInfo, Drive, Experiment, ExperimentError, Sides, TestAxis, open_loop_mm, room_mm, span_mm,
    usable_mm,
};
pub use error::MachineError;
pub use simulated::SimulatedTestAxis;
pub use travel::Travel;
