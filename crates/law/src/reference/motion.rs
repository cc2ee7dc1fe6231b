//! The motions that an axis can be given, as a person writes them and ready for the tick.

use super::harmonic::{Harmonic, HarmonicSettings};
use super::motion_state::MotionState;
use super::point_to_point::{PointToPoint, PointToPointSettings};
use super::recorded::RecordedTable;
use super::sample::{MotionScale, ReferenceSample};
use crate::rounding;
use crate::scalar::Scalar;
use crate::units::{POSITION_FRACTION_BITS, POSITION_UNITS_PER_COUNT, Position};

/// A motion as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
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

/// The way of a reference from one turn to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlannedStroke {
    /// Its length, counts.
    pub counts: u32,
    /// Its largest speed, 2^-16 counts a tick.
    pub speed: u32,
}

impl PlannedStroke {
    /// Of a length and a largest displacement in a tick. Settings time only.
    pub(super) fn new(length: Position, per_tick: f64) -> Self {
        let counts = length.0.unsigned_abs() >> POSITION_FRACTION_BITS;
        Self {
            counts: counts.min(u32::MAX.into()) as u32,
            speed: rounding::ceil(per_tick * POSITION_UNITS_PER_COUNT) as u32,
        }
    }
}

/// A motion ready for the tick.
///
/// ```
/// use quadrant_law::reference::{Motion, MotionScale, MotionSettings, MotionState, PointToPointSettings};
/// use quadrant_law::units::Position;
///
/// let settings = MotionSettings::PointToPoint(PointToPointSettings {
///     distance_mm: 10.0,
///     max_velocity_mm_s: 50.0,
///     max_acceleration_mm_s2: 500.0,
///     max_jerk_mm_s3: 1e4,
/// });
/// let motion = Motion::<f64>::build(&settings, MotionScale::new(0.5e-3, 1e4));
/// let mut state = MotionState::start(Position::ZERO);
/// let mut fastest = 0.0_f64;
/// while !motion.finished(&state) {
///     fastest = fastest.max(motion.step(&mut state).velocity);
/// }
/// assert!(fastest > 49.0 && fastest <= 50.0);
/// assert_eq!(motion.step(&mut state).position, Position::from_mm(10.0, 0.5e-3));
/// ```
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
    /// A reference from elsewhere, at an absolute position: it is exchanged before every tick.
    Given(ReferenceSample<S>),
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
            Self::Given(sample) => return *sample,
        };
        state.elapsed = state.elapsed.saturating_add(1);
        ReferenceSample {
            position: state.origin + sample.position,
            ..sample
        }
    }

    /// The motion's strokes, where they are known before they end.
    pub(crate) fn planned_stroke(&self) -> Option<PlannedStroke> {
        match self {
            Self::PointToPoint(to_point) => Some(to_point.stroke()),
            Self::Harmonic(harmonic) => Some(harmonic.stroke()),
            Self::Hold | Self::Recorded(_) | Self::Given(_) => None,
        }
    }

    /// True if the motion has an end.
    pub fn ends(&self) -> bool {
        match self {
            Self::Harmonic(harmonic) => harmonic.ends(),
            Self::Given(_) => false,
            Self::Hold | Self::PointToPoint(_) | Self::Recorded(_) => true,
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
            Self::Given(_) => false,
        }
    }
}
