//! The names of the axes on a command line.

use clap::ValueEnum;
use quadrant::safety::AxisName;

/// An axis of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Axis {
    /// First axis of the stage.
    X,
    /// Second axis; the heavier one of the simulated stage.
    Y,
    /// Third axis; the vertical one.
    Z,
}

impl Axis {
    /// Index among the stage's axes, 0 to 2.
    pub(super) const fn index(self) -> usize {
        self as usize
    }

    /// Name in lower case.
    pub(super) const fn name(self) -> &'static str {
        AxisName::ALL[self as usize].as_str()
    }
}

impl From<Axis> for AxisName {
    fn from(axis: Axis) -> Self {
        Self::ALL[axis.index()]
    }
}
