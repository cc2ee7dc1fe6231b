//! The names of the axes on a command line.

use clap::ValueEnum;
use quadrant::app::Translated;
use quadrant_law::axes::AxisName;

/// An axis of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    /// First axis of the stage.
    X,
    /// Second axis; the heavier one of the simulated stage.
    Y,
    /// Third axis; the vertical one.
    Z,
}

impl Axis {
    /// Index among the stage's axes, 0 to 2.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Name in lower case.
    pub fn name(self) -> &'static str {
        AxisName::ALL[self as usize].as_str()
    }
}

impl From<Axis> for AxisName {
    fn from(axis: Axis) -> Self {
        Self::ALL[axis.index()]
    }
}

impl From<Axis> for quadrant_link::message::AxisName {
    fn from(axis: Axis) -> Self {
        Translated::translated(AxisName::from(axis))
    }
}
