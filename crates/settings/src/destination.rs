//! Requests to move, checked against the settings before anything moves. For the slow half.

use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt;

use super::axis::AxisSettings;
use super::leaves::limits::LONGEST_TRAVEL_MM;
use super::stage::StageSettings;
use crate::stream_planner::StreamLimits;
use quadrant_law::axes::AxisName;
use quadrant_law::axis::Commissioning;
use quadrant_law::decimal::Decimal;
use quadrant_law::reference::{MotionScale, MotionSettings, PointToPointSettings, Velocity};
use quadrant_law::units::Position;

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
            MoveFlaw::NoHoming => f.write_str(
                "the axis has no homing; set its part `homing`: switch, senses and velocities",
            ),
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

/// The lowest and the highest position of a motion, mm from its start.
pub fn reach_mm(motion: &MotionSettings) -> (f64, f64) {
    match motion {
        MotionSettings::Hold => (0.0, 0.0),
        MotionSettings::PointToPoint(to) => (to.distance_mm.min(0.0), to.distance_mm.max(0.0)),
        MotionSettings::Harmonic(sine) => {
            // Lead-in and lead-out turn half as far as full speed would.
            let lead_rad = PI * sine.frequency_hz * sine.lead_s;
            let first_rad = sine.phase_rad - lead_rad;
            let turned_rad = match sine.cycles {
                Some(cycles) => TAU * cycles + 2.0 * lead_rad,
                None => TAU,
            };
            let (first, last) = (libm::sin(first_rad), libm::sin(first_rad + turned_rad));
            // The sine's next extreme value, 1 at a quarter of a turn, -1 at 3/4 of it.
            let meets = |extreme_rad: f64| {
                let turns = libm::ceil((first_rad - extreme_rad) / TAU);
                extreme_rad + TAU * turns <= first_rad + turned_rad
            };
            let low = if meets(-FRAC_PI_2) {
                -1.0
            } else {
                first.min(last)
            };
            let high = if meets(FRAC_PI_2) {
                1.0
            } else {
                first.max(last)
            };
            let from_start = |sine_value: f64| sine.amplitude_mm * (sine_value - first);
            (from_start(low), from_start(high))
        }
    }
}

impl StageSettings {
    /// Checks that a motion of a homed axis from rest at `from` keeps to its travel; `reach_mm` is what [`reach_mm`] says of it.
    ///
    /// # Errors
    /// The farther end of the motion, and the travel.
    pub fn check_reach(
        &self,
        axis: AxisName,
        from: Position,
        reach_mm: (f64, f64),
    ) -> Result<(), MoveError> {
        let settings = self.axis(axis);
        let Some(travel) = settings.limits.travel_mm else {
            return Ok(());
        };
        // An axis that holds stays where it is, and one at the end of its travel may leave it.
        let count_mm = settings.encoder.resolution_mm;
        let from_mm = from.to_mm(count_mm);
        for (end_mm, moves) in [
            (from_mm + reach_mm.0, reach_mm.0 < -count_mm),
            (from_mm + reach_mm.1, reach_mm.1 > count_mm),
        ] {
            let within =
                end_mm >= travel.negative - count_mm && end_mm <= travel.positive + count_mm;
            if moves && !within {
                return Err(MoveError {
                    axis,
                    flaw: MoveFlaw::BeyondTravel {
                        target_mm: end_mm,
                        travel_mm: (travel.negative, travel.positive),
                    },
                });
            }
        }
        Ok(())
    }

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
    /// jerk. [`PlanSettings::validate`](super::PlanSettings::validate) refuses one that takes too long. Pass it to the axis as its
    /// plan's motion and start it with [`Command::StartMove`](quadrant_law::command::Command::StartMove).
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

    /// The velocity of a jog, for [`Command::Jog`](quadrant_law::command::Command::Jog).
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

    /// Checks that an axis can be homed, before [`Command::Home`](quadrant_law::command::Command::Home), which an axis without
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
                has_law: self.axis(axis).commissioning() != Commissioning::Inert,
            }
        })
    }
}
