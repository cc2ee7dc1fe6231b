//! What can be wrong with a set point of a stream, in words that say what to change.

use core::fmt;

use super::stream_planner::{MOST_MISSING, MOST_SEGMENT_TICKS};
use crate::law::decimal::Decimal;
use crate::law::safety::AxisName;

/// What is wrong with a set point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamFlaw {
    /// Its number is not above the last one's.
    OutOfOrder {
        /// The number of the last set point that was taken.
        last: u32,
    },
    /// Too many set points are missing before it, or the time without one is too long.
    Missing {
        /// How many are missing.
        missing: u32,
    },
    /// The way to it is faster than the axis may move.
    Velocity {
        /// The axis.
        axis: AxisName,
        /// The velocity, mm/s.
        value_mm_s: f64,
        /// The limit, mm/s.
        limit_mm_s: f64,
    },
    /// The way to it accelerates more than the axis may.
    Acceleration {
        /// The axis.
        axis: AxisName,
        /// The acceleration, mm/s^2.
        value_mm_s2: f64,
        /// The limit, mm/s^2.
        limit_mm_s2: f64,
    },
    /// The way to it leaves the axis' travel.
    Travel {
        /// The axis.
        axis: AxisName,
        /// The position, mm.
        value_mm: f64,
        /// The end of the travel that it lies beyond, mm.
        limit_mm: f64,
    },
    /// It is the last, and the axis is not at rest there.
    NotAtRest {
        /// The axis.
        axis: AxisName,
    },
}

/// A refused set point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamError {
    /// Its number.
    pub number: u32,
    /// What is wrong.
    pub flaw: StreamFlaw,
}

impl fmt::Display for StreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "set point {}: ", self.number)?;
        match self.flaw {
            StreamFlaw::OutOfOrder { last } => write!(
                f,
                "its number is not above that of the last one, {last}; number the set points upwards from 1"
            ),
            StreamFlaw::Missing { missing } => write!(
                f,
                "{missing} set points are missing before it, more than {MOST_MISSING}, or more than {MOST_SEGMENT_TICKS} \
                 ticks; send every set point, or lengthen the period"
            ),
            StreamFlaw::Velocity {
                axis,
                value_mm_s,
                limit_mm_s,
            } => write!(
                f,
                "{axis} would move at {:.3} mm/s, above its limit of {:.3} mm/s; \
                 check for a jump of the position, or lower the feed",
                Decimal(value_mm_s),
                Decimal(limit_mm_s)
            ),
            StreamFlaw::Acceleration {
                axis,
                value_mm_s2,
                limit_mm_s2,
            } => write!(
                f,
                "{axis} would accelerate at {:.1} mm/s^2, above its limit of {:.1} mm/s^2; \
                 check that position, velocity and acceleration agree, or lower the feed",
                Decimal(value_mm_s2),
                Decimal(limit_mm_s2)
            ),
            StreamFlaw::Travel {
                axis,
                value_mm,
                limit_mm,
            } => write!(
                f,
                "{axis} would be at {:.3} mm, beyond the end of its travel at {:.3} mm",
                Decimal(value_mm),
                Decimal(limit_mm)
            ),
            StreamFlaw::NotAtRest { axis } => write!(
                f,
                "it ends the stream, and {axis} still moves there; let the last set point have no velocity and \
                 no acceleration"
            ),
        }
    }
}

impl core::error::Error for StreamError {}
