//! Points of a circle's path.

/// A point of the true path in the circle's plane, from the nominal centre; mm.
pub type Point = [f64; 2];
