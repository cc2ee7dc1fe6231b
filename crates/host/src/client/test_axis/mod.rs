//! An axis of a connected machine as one that experiments are run on.

mod axis;
mod injection;
mod recording;
mod stop;

pub use axis::ConnectedAxis;
