//! Motion: where an axis should be at every tick.
//!
//! A [`Motion`] is built at settings time and sampled once per tick. It starts wherever its axis stands and begins
//! and ends at rest. Positions are integers ([`Position`]) from end to end; velocity and
//! acceleration, which only the feedforward reads, are [`Scalar`]s.

mod approach;
mod harmonic;
mod jog;
mod point_to_point;
mod ramp;
mod recorded;
mod sine;
mod stream;
mod stream_error;
mod stream_planner;

pub use approach::Approach;
pub use harmonic::{Harmonic, HarmonicSettings, Plane, Sense, circle};
pub use jog::JogState;
pub use point_to_point::{PointToPoint, PointToPointSettings};
pub use ramp::{Ramp, RampState, Velocity};
pub use recorded::RecordedTable;
pub use stream::{Segment, Stream, StreamState, StreamStep};
pub use stream_error::{StreamError, StreamFlaw};
pub use stream_planner::{
    AxisPoint, LEAST_PERIOD_TICKS, MOST_MISSING, MOST_SEGMENT_TICKS, SetPoint, StreamLimits,
    StreamPlanner,
};

use serde::{Deserialize, Serialize};

use crate::law::scalar::Scalar;
use crate::law::units::Position;

/// Where an axis should be at one tick, and how it should be moving.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceSample<S> {
    /// Position.
    pub position: Position,
    /// Velocity, mm/s.
    pub velocity: S,
    /// Acceleration, mm/s^2.
    pub acceleration: S,
}

/// The scale of an axis' motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionScale {
    /// Length of one encoder count, mm.
    pub resolution_mm: f64,
    /// Control rate, 1/s.
    pub rate_hz: f64,
}

/// A motion as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionSettings {
    /// Stay.
    #[default]
    Hold,
    /// A sine about the start, with lead-in and lead-out.
    Harmonic(HarmonicSettings),
    /// A jerk-limited move.
    PointToPoint(PointToPointSettings),
}

impl MotionSettings {
    /// The largest velocity (mm/s) and acceleration (mm/s^2) that the motion asks for.
    pub fn peaks(&self) -> (f64, f64) {
        match self {
            Self::Hold => (0.0, 0.0),
            Self::Harmonic(settings) => settings.peaks(),
            Self::PointToPoint(settings) => {
                (settings.max_velocity_mm_s, settings.max_acceleration_mm_s2)
            }
        }
    }
}

/// A motion ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Motion<S: Scalar> {
    /// Stay.
    #[default]
    Hold,
    /// A sine about the start.
    Harmonic(Harmonic<S>),
    /// A jerk-limited move.
    PointToPoint(PointToPoint<S>),
    /// A recorded table of positions, relative to its first.
    Recorded(RecordedTable<S>),
}

/// How far a motion has come.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionState {
    origin: Position,
    elapsed: u32,
    phase: u64,
    chain: point_to_point::Chain,
}

impl MotionState {
    /// Before the first tick of a motion that starts at `origin`.
    pub fn start(origin: Position) -> Self {
        Self {
            origin,
            ..Self::default()
        }
    }

    /// Ticks since the start; stays at the largest number rather than wrap.
    pub fn elapsed(&self) -> u32 {
        self.elapsed
    }
}

impl<S: Scalar> Motion<S> {
    /// Builds a motion from validated settings. Settings time only.
    pub fn build(settings: &MotionSettings, scale: MotionScale) -> Self {
        match settings {
            MotionSettings::Hold => Self::Hold,
            MotionSettings::Harmonic(settings) => Self::Harmonic(Harmonic::build(settings, scale)),
            MotionSettings::PointToPoint(settings) => {
                Self::PointToPoint(PointToPoint::build(settings, scale))
            }
        }
    }

    /// The reference of the next tick.
    #[inline(always)]
    pub fn step(&self, state: &mut MotionState) -> ReferenceSample<S> {
        let sample = match self {
            Self::Hold => ReferenceSample::default(),
            Self::Harmonic(harmonic) => harmonic.step(state),
            Self::PointToPoint(to_point) => to_point.step(state),
            Self::Recorded(table) => table.step(state),
        };
        state.elapsed = state.elapsed.saturating_add(1);
        ReferenceSample {
            position: state.origin + sample.position,
            ..sample
        }
    }

    /// Whether the motion has come to its end and stays there.
    #[inline(always)]
    pub fn finished(&self, state: &MotionState) -> bool {
        match self {
            Self::Hold => true,
            Self::Harmonic(harmonic) => harmonic.finished(state),
            Self::PointToPoint(to_point) => to_point.finished(state),
            Self::Recorded(table) => table.finished(state),
        }
    }
}
