//! Cross-checks of the feedback law: its lists rise, its parameters are there, and its loop is stable.

use super::Place;
use crate::axis::AxisSettings;
use crate::error::{Reason, SettingsError};
use crate::popov::filtered_sector_bound;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter;
use quadrant_law::control::nctf::{self, CharacteristicPoint};
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::schedule::{self, SchedulePoint};

/// Paths of the lists and of their numbers that must rise.
const SCHEDULE: &str = "feedback.schedule";
const SPEED: &str = "feedback.schedule.speed_mm_s";
const FILTERS: &str = "feedback.filters";
const CHARACTERISTIC: &str = "feedback.nctf.characteristic";
const ERROR: &str = "feedback.nctf.characteristic.error_mm";
const VELOCITY: &str = "feedback.nctf.characteristic.velocity_mm_s";

impl AxisSettings {
    pub(super) fn validate_feedback(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        if let Some(points) = &self.feedback.schedule {
            at.validate_schedule(points)?;
        }
        if let Some(gains) = &self.feedback.nctf {
            at.validate_characteristic(&gains.characteristic)?;
        }
        if let Some(filters) = &self.feedback.filters {
            at.within(
                FILTERS,
                filters.len() as f64,
                1.0,
                filter::MAX_FILTERS as f64,
            )?;
        }
        self.validate_law(at, period_s)
    }

    /// The law that acts has its parameters and is stable.
    fn validate_law(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let feedback = &self.feedback;
        let (field, missing) = match feedback.law {
            LawKind::Pd | LawKind::Pid => ("feedback.pid", false),
            LawKind::NPid => ("feedback.nonlinear", feedback.nonlinear.is_none()),
            LawKind::Scheduled => (SCHEDULE, feedback.schedule.is_none()),
            LawKind::Cascade => ("feedback.cascade", feedback.cascade.is_none()),
            LawKind::SlidingMode => ("feedback.sliding_mode", feedback.sliding_mode.is_none()),
            LawKind::Nctf => ("feedback.nctf", feedback.nctf.is_none()),
        };
        if missing {
            return at.refuse(field, f64::NAN, Reason::Missing);
        }
        let Some(plant) = &self.plant else {
            return Ok(());
        };
        let linear = match feedback.law {
            LawKind::Pd | LawKind::Pid | LawKind::NPid => "feedback.pid.kp_v_per_mm",
            _ => field,
        };
        let filters = feedback.filters.as_deref().unwrap_or_default();
        for gains in feedback.linear_gains() {
            let has_gain =
                [gains.kp_v_per_mm, gains.ki_v_per_mm_s, gains.kd_v_s_per_mm] != [0.0; 3];
            match (has_gain, self.commissioned) {
                (true, _) => {}
                // No loop is closed: the plant was identified first.
                (false, false) => continue,
                (false, true) => return at.refuse(linear, 0.0, Reason::NoGain),
            }
            let bound = filtered_sector_bound(plant, &gains, filters, period_s);
            if bound <= 1.0 {
                return at.refuse(linear, gains.kp_v_per_mm, Reason::Unstable);
            }
            let largest = feedback
                .nonlinear
                .as_ref()
                .map_or(1.0, NonlinearGain::largest);
            if feedback.law == LawKind::NPid && largest > bound {
                let rate = feedback.nonlinear.map_or(0.0, |gain| gain.rate_per_mm);
                let reason = Reason::BeyondPopov { bound };
                return at.refuse("feedback.nonlinear.rate_per_mm", rate, reason);
            }
        }
        Ok(())
    }
}

impl Place {
    fn validate_schedule(self, points: &[SchedulePoint]) -> Result<(), SettingsError> {
        self.within(
            SCHEDULE,
            points.len() as f64,
            1.0,
            schedule::MAX_POINTS as f64,
        )?;
        let mut before = None;
        for point in points {
            match before {
                // The first point is at rest.
                None => self.within(SPEED, point.speed_mm_s, 0.0, 0.0)?,
                Some(speed) if point.speed_mm_s <= speed => {
                    return self.refuse(SPEED, point.speed_mm_s, Reason::NotRising);
                }
                Some(_) => {}
            }
            before = Some(point.speed_mm_s);
        }
        Ok(())
    }

    fn validate_characteristic(self, points: &[CharacteristicPoint]) -> Result<(), SettingsError> {
        self.within(
            CHARACTERISTIC,
            points.len() as f64,
            1.0,
            nctf::MAX_POINTS as f64,
        )?;
        let mut before = (0.0, 0.0);
        for point in points {
            if point.error_mm <= before.0 {
                return self.refuse(ERROR, point.error_mm, Reason::NotRising);
            }
            if point.velocity_mm_s < before.1 {
                return self.refuse(VELOCITY, point.velocity_mm_s, Reason::NotRising);
            }
            before = (point.error_mm, point.velocity_mm_s);
        }
        Ok(())
    }
}
