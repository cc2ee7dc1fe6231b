//! Axes and set points.

use core::fmt;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::law::axes::AxisName;

/// Set points that one request holds at most.
pub const STREAM_POINTS: usize = 8;

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
    /// No axis.
    pub const NONE: Self = Self(0);

    /// All axes.
    pub const ALL: Self = Self(7);

    /// The set and one axis more.
    #[must_use]
    pub const fn with(self, axis: AxisName) -> Self {
        Self(self.0 | 1 << axis as u8)
    }

    /// Whether an axis is one of them.
    pub const fn contains(self, axis: AxisName) -> bool {
        self.0 >> axis as u8 & 1 == 1
    }

    /// Whether there is none.
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

/// Where one axis should be at a set point, and how it should be moving there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AxisPoint {
    /// Position, mm from the home position.
    pub position_mm: f64,
    /// Velocity, mm/s.
    pub velocity_mm_s: f32,
    /// Acceleration, mm/s^2.
    pub acceleration_mm_s2: f32,
}

/// Where the axes should be together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetPoint {
    /// The axes.
    pub axes: [AxisPoint; 3],
}

/// What is asked of the stream of set points.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum StreamRequest {
    /// Begin.
    Open {
        /// Control ticks from one set point to the next.
        period_ticks: u16,
    },
    /// The next set points.
    Points {
        /// The number of the first of them, from zero. Points that the server has already are passed over, so that a
        /// request may be repeated; a few that are missing are bridged, more are an error.
        sequence: u32,
        /// The points.
        points: Vec<SetPoint, STREAM_POINTS>,
        /// The stream ends, at rest, with the last of these points.
        last: bool,
    },
    /// Break the stream off and brake to rest.
    Close,
}

/// How far the stream of set points has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StreamStatus {
    /// The number of the set point that the server expects next.
    pub next_sequence: u32,
    /// Set points that it has room for now.
    pub free: u16,
}
