//! Motions: the plan, and streams of set points.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Set points that one request holds at most.
pub const STREAM_POINTS: usize = 8;

/// The motions of the axes, started together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// One motion an axis: x, y, z.
    pub motions: [Motion; 3],
}

/// The motion of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// None: the reference stands.
    #[default]
    Hold,
    /// A sine about the start, with lead-in and lead-out.
    Harmonic(Harmonic),
    /// A jerk-limited move.
    PointToPoint(PointToPoint),
}

/// The sine `amplitude sin(2 pi frequency t + phase)` about its centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Harmonic {
    /// Half the travel, mm.
    pub amplitude_mm: f64,
    /// Cycles per second at full speed, Hz.
    pub frequency_hz: f64,
    /// Phase at which the full-speed cycles begin, rad.
    pub phase_rad: f64,
    /// Cycles at full speed; `None` for an endless motion.
    pub cycles: Option<f64>,
    /// Duration of the lead-in and of the lead-out, s.
    pub lead_s: f64,
}

/// A jerk-limited move by a distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointToPoint {
    /// Signed distance, mm.
    pub distance_mm: f64,
    /// Largest velocity, mm/s.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration, mm/s^2.
    pub max_acceleration_mm_s2: f64,
    /// Largest jerk, mm/s^3.
    pub max_jerk_mm_s3: f64,
}

/// One axis of a set point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AxisPoint {
    /// Position, mm from the home position.
    pub position_mm: f64,
    /// Velocity, mm/s.
    pub velocity_mm_s: f32,
    /// Acceleration, mm/s^2.
    pub acceleration_mm_s2: f32,
}

/// Positions of the axes at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetPoint {
    /// The axes.
    pub axes: [AxisPoint; 3],
}

/// A request about the stream of set points.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum StreamRequest {
    /// Begins a stream.
    Open {
        /// Control ticks from one set point to the next.
        period_ticks: u16,
    },
    /// The next set points.
    Points {
        /// The number of the first of them, from zero. Points that the server has already are passed over, so that a
        /// request may be repeated; a few that are missing are bridged, more are an error.
        sequence: u32,
        /// The points, in order.
        points: Vec<SetPoint, STREAM_POINTS>,
        /// The stream ends, at rest, with the last of these points.
        last: bool,
    },
    /// Break the stream off and brake to rest.
    Close,
}

/// Progress of the stream of set points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StreamStatus {
    /// The number of the set point that the server expects next.
    pub next_sequence: u32,
    /// Set points that it has room for now.
    pub free: u16,
}
