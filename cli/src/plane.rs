//! The names of the planes on a command line.

use clap::ValueEnum;
use quadrant_law::reference::Plane;

/// A plane, as G17 to G19 select it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum PlaneName {
    /// x and y, G17.
    Xy,
    /// y and z, G19.
    Yz,
    /// z and x, G18.
    Zx,
}

impl PlaneName {
    pub(super) const fn plane(self) -> Plane {
        match self {
            Self::Xy => Plane::Xy,
            Self::Yz => Plane::Yz,
            Self::Zx => Plane::Zx,
        }
    }

    /// Name in lower case.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Xy => "xy",
            Self::Yz => "yz",
            Self::Zx => "zx",
        }
    }
}
