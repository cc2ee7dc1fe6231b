//! Checks of the feedback law.

use super::Place;
use crate::law::control::feedback::LawKind;
use crate::law::control::npid::NonlinearGain;
use crate::law::control::popov::sector_bound;
use crate::law::control::schedule::SchedulePoint;
use crate::settings::{AxisSettings, Reason, SettingsError};

/// Largest share of a schedule: what [`crate::law::scalar::Quantity::Multiplier`] holds.
const MOST_SHARE: f64 = 30.0;

impl AxisSettings {
    pub(super) fn validate_feedback(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let feedback = &self.feedback;
        let pid = &feedback.pid;
        at.within("feedback.pid.kp_v_per_mm", pid.kp_v_per_mm, 0.0, 1e4)?;
        at.within("feedback.pid.ki_v_per_mm_s", pid.ki_v_per_mm_s, 0.0, 1e6)?;
        at.within("feedback.pid.kd_v_s_per_mm", pid.kd_v_s_per_mm, 0.0, 1e2)?;
        at.within(
            "feedback.pid.derivative_filter_s",
            pid.derivative_filter_s,
            0.5 * period_s,
            1.0,
        )?;
        at.within(
            "feedback.integral_limit_v",
            feedback.integral_limit_v,
            1e-6,
            self.amplifier.output_limit_v,
        )?;
        at.within("feedback.transfer_s", feedback.transfer_s, 1e-3, 10.0)?;
        if let Some(nonlinear) = &feedback.nonlinear {
            at.validate_nonlinear(nonlinear)?;
        }
        if let Some(schedule) = &feedback.schedule {
            at.validate_schedule(schedule)?;
        }
        self.validate_cascade(at)?;
        self.validate_sliding_mode(at)?;
        self.validate_nctf(at)?;
        self.validate_law(at, period_s)
    }

    /// The law that acts has its parameters and is stable.
    fn validate_law(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let feedback = &self.feedback;
        let (field, missing) = match feedback.law {
            LawKind::Pd | LawKind::Pid => ("feedback.pid", false),
            LawKind::NPid => ("feedback.nonlinear", feedback.nonlinear.is_none()),
            LawKind::Scheduled => ("feedback.schedule", feedback.schedule.is_none()),
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
        for gains in feedback.linear_gains() {
            let bound = sector_bound(plant, &gains, period_s);
            if bound <= 1.0 {
                return at.refuse(field, gains.kp_v_per_mm, Reason::Unstable);
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

    fn validate_cascade(&self, at: Place) -> Result<(), SettingsError> {
        let Some(gains) = &self.feedback.cascade else {
            return Ok(());
        };
        at.within(
            "feedback.cascade.position_gain_per_s",
            gains.position_gain_per_s,
            1e-3,
            1e4,
        )?;
        at.within(
            "feedback.cascade.velocity_gain_v_s_per_mm",
            gains.velocity_gain_v_s_per_mm,
            1e-9,
            1e2,
        )?;
        at.within(
            "feedback.cascade.velocity_integral_per_s",
            gains.velocity_integral_per_s,
            0.0,
            1e4,
        )?;
        at.within(
            "feedback.cascade.velocity_feedforward",
            gains.velocity_feedforward,
            0.0,
            1.0,
        )?;
        at.within(
            "feedback.cascade.velocity_limit_mm_s",
            gains.velocity_limit_mm_s,
            1e-3,
            1e3,
        )
    }

    fn validate_sliding_mode(&self, at: Place) -> Result<(), SettingsError> {
        let Some(gains) = &self.feedback.sliding_mode else {
            return Ok(());
        };
        at.within(
            "feedback.sliding_mode.slope_per_s",
            gains.slope_per_s,
            1e-3,
            1e4,
        )?;
        at.within(
            "feedback.sliding_mode.switching_v",
            gains.switching_v,
            1e-6,
            self.amplifier.output_limit_v,
        )?;
        at.within(
            "feedback.sliding_mode.boundary_mm_s",
            gains.boundary_mm_s,
            1e-3,
            1e3,
        )?;
        at.within(
            "feedback.sliding_mode.integral_per_s",
            gains.integral_per_s,
            0.0,
            1e4,
        )
    }

    fn validate_nctf(&self, at: Place) -> Result<(), SettingsError> {
        const POINTS: &str = "feedback.nctf.characteristic";
        const ERROR: &str = "feedback.nctf.characteristic.error_mm";
        const VELOCITY: &str = "feedback.nctf.characteristic.velocity_mm_s";
        let Some(gains) = &self.feedback.nctf else {
            return Ok(());
        };
        let count = gains.characteristic.len() as f64;
        let most = crate::law::control::nctf::MAX_POINTS as f64;
        at.within(POINTS, count, 1.0, most)?;
        let mut before = (0.0, 0.0);
        for point in &gains.characteristic {
            at.within(ERROR, point.error_mm, 1e-6, 30.0)?;
            at.within(VELOCITY, point.velocity_mm_s, 1e-3, 1e3)?;
            if point.error_mm <= before.0 {
                return at.refuse(ERROR, point.error_mm, Reason::NotRising);
            }
            if point.velocity_mm_s < before.1 {
                return at.refuse(VELOCITY, point.velocity_mm_s, Reason::NotRising);
            }
            before = (point.error_mm, point.velocity_mm_s);
        }
        at.within(
            "feedback.nctf.gain_v_s_per_mm",
            gains.gain_v_s_per_mm,
            1e-9,
            1e2,
        )?;
        at.within(
            "feedback.nctf.integral_per_s",
            gains.integral_per_s,
            0.0,
            1e4,
        )
    }
}

impl Place {
    fn validate_nonlinear(self, nonlinear: &NonlinearGain) -> Result<(), SettingsError> {
        self.within(
            "feedback.nonlinear.range_mm",
            nonlinear.range_mm,
            1e-3,
            10.0,
        )?;
        // cosh(3.4) is 15: within the fixed-point format, and far beyond any Popov bound met in practice.
        self.within(
            "feedback.nonlinear.rate_per_mm",
            nonlinear.rate_per_mm,
            0.0,
            3.4 / nonlinear.range_mm,
        )
    }

    fn validate_schedule(self, schedule: &[SchedulePoint]) -> Result<(), SettingsError> {
        const POINTS: &str = "feedback.schedule";
        const SPEED: &str = "feedback.schedule.speed_mm_s";
        let most = crate::law::control::schedule::MAX_POINTS as f64;
        self.within(POINTS, schedule.len() as f64, 1.0, most)?;
        let mut before = None;
        for point in schedule {
            // The first point is at rest.
            let highest = if before.is_some() { 1e3 } else { 0.0 };
            self.within(SPEED, point.speed_mm_s, 0.0, highest)?;
            if before.is_some_and(|speed| point.speed_mm_s <= speed) {
                return self.refuse(SPEED, point.speed_mm_s, Reason::NotRising);
            }
            before = Some(point.speed_mm_s);
            for (field, share) in [
                ("feedback.schedule.proportional", point.proportional),
                ("feedback.schedule.integral", point.integral),
                ("feedback.schedule.derivative", point.derivative),
            ] {
                self.within(field, share, 0.0, MOST_SHARE)?;
            }
        }
        Ok(())
    }
}
