//! Speed limits of a path: of each element, and of each joint between two elements.

use quadrant_settings::StageSettings;

use crate::error::ProgramError;
use crate::interpret::Move;
use crate::modal::PathControl;
use crate::velocity_profile::Pace;

/// Limits of the motion along a path, of the axes and of the path.
///
/// Each axis' acceleration limit is shared out, so that the sampled motion keeps it in every combination: 0.88 of it
/// for curves and changes of speed, 0.1 for the small corner at a joint that is tangent only within tolerance, taken in
/// one control period, and the rest for an arc's allowed mismatch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest velocity of each axis, mm/s.
    pub velocity_mm_s: [f64; 3],
    /// Largest acceleration of each axis, mm/s^2.
    pub acceleration_mm_s2: [f64; 3],
    /// Largest acceleration along the path, mm/s^2; 1 to 1e5.
    pub path_acceleration_mm_s2: f64,
    /// Largest jerk along the path, mm/s^3; 10 to 1e9.
    pub path_jerk_mm_s3: f64,
    /// Largest deviation of the path at a corner between straight lines, mm, where the program does not say by G61 or G64 P;
    /// zero stops there exactly. 0 to 10.
    pub corner_deviation_mm: f64,
    /// Travel of each axis, mm from the program's origin, its lower and upper end.
    pub travel_mm: [(f64, f64); 3],
    /// Control rate, 1/s.
    pub rate_hz: f64,
}

/// Share of an axis' acceleration for curves and changes of speed.
const CURVE_SHARE: f64 = 0.88;
/// Share of it for the corner at a joint.
const JOINT_SHARE: f64 = 0.1;
/// Of an arc's part, the share for changes of speed; what is left for the curve makes a right angle with it.
const ARC_TANGENTIAL_SHARE: f64 = 0.5;
/// The largest change of direction that still counts as tangent, rad: one degree.
const TANGENT_RAD: f64 = std::f64::consts::PI / 180.0;
/// Acceleration along the path, mm/s^2; chosen: with the jerk below, of a mid-sized machining centre.
const PATH_ACCELERATION_MM_S2: f64 = 500.0;
/// Jerk along the path, mm/s^3; chosen.
const PATH_JERK_MM_S3: f64 = 20_000.0;
/// Half the travel of the simulated stage's axes, mm.
const HALF_TRAVEL_MM: f64 = 200.0;

impl Limits {
    /// The limits of a stage that stands in the middle of its travel, with path limits that suit it and exact corners.
    pub fn of(stage: &StageSettings) -> Self {
        let limits = stage.axes.each_ref().map(|axis| axis.limits);
        Self {
            velocity_mm_s: limits.map(|limits| limits.max_velocity_mm_s),
            acceleration_mm_s2: limits.map(|limits| limits.max_acceleration_mm_s2),
            path_acceleration_mm_s2: PATH_ACCELERATION_MM_S2,
            path_jerk_mm_s3: PATH_JERK_MM_S3,
            corner_deviation_mm: 0.0,
            travel_mm: [(-HALF_TRAVEL_MM, HALF_TRAVEL_MM); 3],
            rate_hz: stage.rate_hz,
        }
    }

    /// Checks the limits that a person sets.
    pub(super) fn check(&self) -> Result<(), ProgramError> {
        for (what, value, least, most) in [
            (
                "the acceleration along the path, mm/s^2,",
                self.path_acceleration_mm_s2,
                1.0,
                1e5,
            ),
            (
                "the jerk along the path, mm/s^3,",
                self.path_jerk_mm_s3,
                10.0,
                1e9,
            ),
            (
                "the corner deviation, mm,",
                self.corner_deviation_mm,
                0.0,
                10.0,
            ),
        ] {
            if !(least..=most).contains(&value) {
                return Err(ProgramError::Limit {
                    what,
                    value,
                    least,
                    most,
                });
            }
        }
        Ok(())
    }

    /// Refuses a move that leaves an axis' travel.
    pub(super) fn check_travel(&self, step: &Move) -> Result<(), ProgramError> {
        for (index, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (low_mm, high_mm) = self.travel_mm[index];
            let (least, most) = step.segment.extent(index);
            // Rounding of an arc's crest is no excursion.
            let beyond = [least, most]
                .into_iter()
                .find(|mm| !(low_mm - 1e-9..=high_mm + 1e-9).contains(mm));
            if let Some(reaches_mm) = beyond {
                return Err(ProgramError::Travel {
                    line: step.line,
                    axis,
                    reaches_mm,
                    low_mm,
                    high_mm,
                });
            }
        }
        Ok(())
    }

    /// The largest speed on a move, mm/s, and the pace along it.
    pub(super) fn on(&self, step: &Move) -> (f64, Pace) {
        let curvature = step.segment.curvature_per_mm();
        let (along_share, across_share) = if curvature > 0.0 {
            let across = (1.0 - ARC_TANGENTIAL_SHARE * ARC_TANGENTIAL_SHARE).sqrt();
            (CURVE_SHARE * ARC_TANGENTIAL_SHARE, CURVE_SHARE * across)
        } else {
            (CURVE_SHARE, 0.0)
        };
        let mut speed = step.feed_mm_s.unwrap_or(f64::INFINITY);
        let mut acceleration = self.path_acceleration_mm_s2;
        for (axis, (along, across)) in step.segment.axis_shares().into_iter().enumerate() {
            let limit = self.acceleration_mm_s2[axis];
            if along > 0.0 {
                speed = speed.min(self.velocity_mm_s[axis] / along);
                acceleration = acceleration.min(along_share * limit / along);
            }
            if across > 0.0 {
                speed = speed.min((across_share * limit / (across * curvature)).sqrt());
            }
        }
        let pace = Pace {
            acceleration_mm_s2: acceleration,
            jerk_mm_s3: self.path_jerk_mm_s3,
        };
        (speed, pace)
    }

    /// The largest speed through the joint of two moves, mm/s.
    pub(super) fn through(&self, before: &Move, after: &Move) -> f64 {
        let stops = |step: &Move| step.path_control == PathControl::ExactStop;
        if before.rest_s > 0.0 || stops(before) || stops(after) {
            return 0.0;
        }
        let arrives = before.segment.tangent(before.segment.length_mm());
        let corner = after.segment.tangent(0.0) - arrives;
        if corner.norm() > TANGENT_RAD {
            return 0.0;
        }
        // The corner is turned within one control period.
        (0..3)
            .map(|axis| {
                JOINT_SHARE * self.acceleration_mm_s2[axis] / (self.rate_hz * corner[axis].abs())
            })
            .fold(f64::INFINITY, f64::min)
    }
}
