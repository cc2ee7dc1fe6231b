//! Motion: where an axis should be at every tick.
//!
//! A [`Motion`] is built at settings time and sampled once per tick. It starts wherever its axis stands and begins
//! and ends at rest. Positions are integers ([`Position`](crate::units::Position)) from end to end; velocity and
//! acceleration, which only the feedforward reads, are [`Scalar`](crate::scalar::Scalar)s.

mod approach;
mod circle;
mod harmonic;
mod jog;
mod motion;
mod motion_state;
mod point_to_point;
mod pulses;
mod ramp;
mod recorded;
mod sample;
pub(crate) mod sine;
mod stream;

pub use approach::Approach;
pub use circle::{Plane, Sense, circle};
pub use harmonic::{Harmonic, HarmonicSettings};
pub use jog::JogState;
pub use motion::{Motion, MotionSettings, PlannedStroke};
pub use motion_state::MotionState;
pub use point_to_point::{PointToPoint, PointToPointSettings};
pub use pulses::{
    FollowedPulses, MAX_PULSE_DELAY_TICKS, MAX_PULSE_WAIT_TICKS, PulseReference, PulseScale,
    PulseState,
};
pub use ramp::{Ramp, RampState, Velocity, steps_per_mm};
pub use recorded::RecordedTable;
pub use sample::{MotionScale, ReferenceSample};
pub use stream::{Segment, Stream, StreamState, StreamStep};
