//! Requests to move, checked against the settings before anything moves. For the slow half.

use core::fmt;

use super::axis::AxisSettings;
use super::leaves::limits::LONGEST_TRAVEL_MM;
use super::stage::StageSettings;
use crate::law::axes::AxisName;
use crate::law::decimal::Decimal;
use crate::law::reference::{MotionScale, PointToPointSettings, StreamLimits, Velocity};
use crate::law::units::Position;

/// Reason why an axis is not moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MoveFlaw {
    /// The axis does not know where it is.
    NotHomed,
    /// The settings do not say how the axis is homed.
    NoHoming,
    /// The destination lies beyond the travel.
    BeyondTravel {
        /// Requested position, mm.
        target_mm: f64,
        /// The travel's ends, mm.
        travel_mm: (f64, f64),
    },
    /// The velocity is not above zero, or above the axis' largest.
    Velocity {
        /// Requested velocity, mm/s.
        value_mm_s: f64,
        /// Largest velocity of the axis, mm/s.
        limit_mm_s: f64,
    },
}

/// A refused request to move an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveError {
    /// Axis that was to move.
    pub axis: AxisName,
    /// Reason.
    pub flaw: MoveFlaw,
}

impl fmt::Display for MoveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.axis)?;
        match self.flaw {
            MoveFlaw::NotHomed => {
                f.write_str("the axis does not know where it is; home it first, or jog")
            }
            MoveFlaw::NoHoming => f.write_str("the axis has no homing; set its homing"),
            MoveFlaw::BeyondTravel {
                target_mm,
                travel_mm: (negative, positive),
            } => write!(
                f,
                "{} mm is outside the travel of {} to {} mm",
                Decimal(target_mm),
                Decimal(negative),
                Decimal(positive)
            ),
            MoveFlaw::Velocity {
                value_mm_s,
                limit_mm_s,
            } => write!(
                f,
                "a velocity of {} mm/s is outside 0 (exclusive) to {} mm/s",
                Decimal(value_mm_s),
                Decimal(limit_mm_s)
            ),
        }
    }
}

impl core::error::Error for MoveError {}

impl StageSettings {
    /// The settings of an axis.
    pub fn axis(&self, axis: AxisName) -> &AxisSettings {
        let [x, y, z] = &self.axes;
        match axis {
            AxisName::X => x,
            AxisName::Y => y,
            AxisName::Z => z,
        }
    }

    /// The scale of an axis' motions.
    pub fn scale_of(&self, axis: AxisName) -> MotionScale {
        MotionScale {
            resolution_mm: self.axis(axis).encoder.resolution_mm,
            rate_hz: self.rate_hz,
        }
    }

    /// The move of a homed axis from rest at `from` to `target_mm` at `velocity_mm_s`, within the axis' acceleration and
    /// jerk. [`PlanSettings::validate`](super::PlanSettings::validate) refuses one that takes too long. Hand it to the axis as its
    /// plan's motion and start it with [`Command::StartMove`](crate::law::command::Command::StartMove).
    ///
    /// # Errors
    /// The axis is not homed, the target beyond its travel, or the velocity out of its range.
    pub fn move_to(
        &self,
        axis: AxisName,
        from: Position,
        homed: bool,
        target_mm: f64,
        velocity_mm_s: f64,
    ) -> Result<PointToPointSettings, MoveError> {
        let refuse = |flaw| Err(MoveError { axis, flaw });
        let settings = self.axis(axis);
        let limits = &settings.limits;
        if !homed {
            return refuse(MoveFlaw::NotHomed);
        }
        let travel_mm = limits
            .travel_mm
            .as_ref()
            .map_or((-LONGEST_TRAVEL_MM, LONGEST_TRAVEL_MM), |travel| {
                (travel.negative, travel.positive)
            });
        // So written, what is not a number is refused.
        if !(target_mm >= travel_mm.0 && target_mm <= travel_mm.1) {
            return refuse(MoveFlaw::BeyondTravel {
                target_mm,
                travel_mm,
            });
        }
        if !(velocity_mm_s > 0.0 && velocity_mm_s <= limits.max_velocity_mm_s) {
            return refuse(MoveFlaw::Velocity {
                value_mm_s: velocity_mm_s,
                limit_mm_s: limits.max_velocity_mm_s,
            });
        }
        let resolution_mm = settings.encoder.resolution_mm;
        // From whole units to whole units, so that the move ends on the target's.
        let distance = Position::from_mm(target_mm, resolution_mm) - from;
        Ok(PointToPointSettings {
            distance_mm: distance.to_mm(resolution_mm),
            max_velocity_mm_s: velocity_mm_s,
            max_acceleration_mm_s2: limits.max_acceleration_mm_s2,
            max_jerk_mm_s3: limits.max_jerk_mm_s3,
        })
    }

    /// The velocity of a jog, for [`Command::Jog`](crate::law::command::Command::Jog).
    ///
    /// # Errors
    /// A speed above the axis' largest, or no number.
    pub fn jog_at(&self, axis: AxisName, velocity_mm_s: f64) -> Result<Velocity, MoveError> {
        let limit_mm_s = self.axis(axis).limits.max_velocity_mm_s;
        if !(velocity_mm_s >= -limit_mm_s && velocity_mm_s <= limit_mm_s) {
            return Err(MoveError {
                axis,
                flaw: MoveFlaw::Velocity {
                    value_mm_s: velocity_mm_s,
                    limit_mm_s,
                },
            });
        }
        Ok(Velocity::from_mm_s(velocity_mm_s, self.scale_of(axis)))
    }

    /// Checks that an axis can be homed, before [`Command::Home`](crate::law::command::Command::Home), which an axis without
    /// homing ignores.
    ///
    /// # Errors
    /// The settings do not say how.
    pub fn can_home(&self, axis: AxisName) -> Result<(), MoveError> {
        match self.axis(axis).homing {
            Some(_) => Ok(()),
            None => Err(MoveError {
                axis,
                flaw: MoveFlaw::NoHoming,
            }),
        }
    }

    /// Limits of streamed set points; the travel holds for axes that are homed.
    pub fn stream_limits(&self, homed: [bool; 3]) -> [StreamLimits; 3] {
        let [x, y, z] = AxisName::ALL;
        let [of_x, of_y, of_z] = homed;
        [(x, of_x), (y, of_y), (z, of_z)].map(|(axis, homed)| {
            let scale = self.scale_of(axis);
            let limits = &self.axis(axis).limits;
            let position = |value_mm| Position::from_mm(value_mm, scale.resolution_mm);
            StreamLimits {
                scale,
                max_velocity_mm_s: limits.max_velocity_mm_s,
                max_acceleration_mm_s2: limits.max_acceleration_mm_s2,
                travel: limits
                    .travel_mm
                    .as_ref()
                    .filter(|_| homed)
                    .map(|travel| (position(travel.negative), position(travel.positive))),
            }
        })
    }
}
