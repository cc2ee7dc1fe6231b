//! The axis that an experiment is run on.

use clap::ValueEnum;

use crate::plant::StageTruth;
use crate::rig::SimulatedRig;

/// An axis of the simulated stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// Its place among the stage's axes.
    pub const fn index(self) -> usize {
        self as usize
    }

    pub const fn name(self) -> &'static str {
        ["x", "y", "z"][self as usize]
    }

    /// The axis, with everything a real one has; `seed` decides its noise.
    pub fn rig(self, seed: u64) -> SimulatedRig {
        let [x, y, z] = StageTruth::real().axes;
        let truth = match self {
            Self::X => x,
            Self::Y => y,
            Self::Z => z,
        };
        SimulatedRig::new(self.index(), truth, seed)
    }
}
