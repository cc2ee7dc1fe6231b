//! Bounds of what a record can hold.

/// Fewest rows that make a motion.
pub(super) const MIN_ROWS: usize = 16;

/// Limits of an axis: the yardstick for units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimits {
    /// Length of the longest motion, mm.
    pub travel_mm: f64,
    /// Highest speed of the axis, mm/s.
    pub max_velocity_mm_s: f64,
    /// Highest acceleration of the axis, mm/s^2.
    pub max_acceleration_mm_s2: f64,
    /// One count of the encoder, mm.
    pub resolution_mm: f64,
}
