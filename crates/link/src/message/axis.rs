//! Names of axes, and sets of them.

use core::fmt;

use serde::{Deserialize, Serialize};
use strum::{Display, EnumString, IntoStaticStr};

/// An axis.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Display, EnumString, IntoStaticStr,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum AxisName {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

impl AxisName {
    /// All axes, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The axis' name in lower case.
    pub fn as_str(self) -> &'static str {
        self.into()
    }
}

/// Some of the axes: bit 0 for x, 1 for y, 2 for z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct AxisSet(u8);

/// The bits name an axis that there is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownAxes(u8);

impl fmt::Display for UnknownAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "axes: {:#04x} has more than the bits of x, y and z (0x07)",
            self.0
        )
    }
}

impl AxisSet {
    /// The empty set.
    pub const NONE: Self = Self(0);

    /// The set of all axes.
    pub const ALL: Self = Self(7);

    /// The set and one axis more.
    #[must_use]
    pub const fn with(self, axis: AxisName) -> Self {
        Self(self.0 | 1 << axis as u8)
    }

    /// True if an axis is one of them.
    pub const fn contains(self, axis: AxisName) -> bool {
        self.0 >> axis as u8 & 1 == 1
    }

    /// True if there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The axes, in order.
    pub fn iter(self) -> impl Iterator<Item = AxisName> {
        AxisName::ALL
            .into_iter()
            .filter(move |&axis| self.contains(axis))
    }
}

impl FromIterator<AxisName> for AxisSet {
    fn from_iter<I: IntoIterator<Item = AxisName>>(axes: I) -> Self {
        axes.into_iter().fold(Self::NONE, Self::with)
    }
}

impl From<AxisSet> for u8 {
    fn from(axes: AxisSet) -> Self {
        axes.0
    }
}

impl TryFrom<u8> for AxisSet {
    type Error = UnknownAxes;

    fn try_from(bits: u8) -> Result<Self, UnknownAxes> {
        if bits <= Self::ALL.0 {
            Ok(Self(bits))
        } else {
            Err(UnknownAxes(bits))
        }
    }
}
