//! A point of the reference, and the scale that it is made with.

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
