//! The motions that an axis can be given, as a person writes them and ready for the tick.

use serde::{Deserialize, Serialize};

use super::harmonic::{Harmonic, HarmonicSettings};
use super::motion_state::MotionState;
use super::point_to_point::{PointToPoint, PointToPointSettings};
use super::recorded::RecordedTable;
use super::sample::{MotionScale, ReferenceSample};
use crate::law::scalar::Scalar;

/// A motion as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionSettings {
    /// Stay where the axis is.
    #[default]
    Hold,
    /// A sine about the start, with lead-in and lead-out.
    Harmonic(HarmonicSettings),
    /// A jerk-limited move over a distance.
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
    /// Stay where the axis is.
    #[default]
    Hold,
    /// A sine about the start.
    Harmonic(Harmonic<S>),
    /// A jerk-limited move over a distance.
    PointToPoint(PointToPoint<S>),
    /// A recorded table of positions, relative to its first.
    Recorded(RecordedTable<S>),
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

    /// True if the motion has come to its end and stays there.
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
