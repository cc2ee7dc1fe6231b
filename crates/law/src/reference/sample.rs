//! A point of the reference, and the scale that it is made with.

use crate::scalar::Scalar;
use crate::units::Position;

/// Position of the reference at one tick, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceSample<S> {
    /// Position of the reference, 2^-16 counts.
    pub position: Position,
    /// Velocity of the reference, mm/s.
    pub velocity: S,
    /// Acceleration of the reference, mm/s^2.
    pub acceleration: S,
}

impl<S: Scalar> ReferenceSample<S> {
    /// At rest at a position.
    #[inline(always)]
    pub(crate) fn standing(position: Position) -> Self {
        Self {
            position,
            ..Self::default()
        }
    }
}

/// The scale of an axis' motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionScale {
    /// Length of one encoder count, mm.
    pub resolution_mm: f64,
    /// Control ticks per second, 1/s.
    pub rate_hz: f64,
}

impl MotionScale {
    /// Counts of `resolution_mm`, ticks at `rate_hz`.
    pub const fn new(resolution_mm: f64, rate_hz: f64) -> Self {
        Self {
            resolution_mm,
            rate_hz,
        }
    }

    /// The control period, s.
    pub const fn period_s(self) -> f64 {
        1.0 / self.rate_hz
    }
}
