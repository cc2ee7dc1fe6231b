//! The names that [`machine`](crate::machine) had for test axes, until every caller has the new ones.

pub use crate::machine::{
    AxisInfo as RigAxis, Drive, Experiment, ExperimentError as RigError,
    SimulatedTestAxis as SimulatedRig, TestAxis as Rig, approach,
};
pub use crate::record::Recording;
