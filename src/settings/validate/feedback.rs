//! Checks of the feedback law.

use super::Place;
use crate::control::popov::sector_bound;
use crate::settings::{AxisSettings, Reason, SettingsError};

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
        let Some(nonlinear) = &feedback.nonlinear else {
            return Ok(());
        };
        at.within(
            "feedback.nonlinear.range_mm",
            nonlinear.range_mm,
            1e-3,
            10.0,
        )?;
        // cosh(3.4) is 15: within the fixed-point format, and far beyond any Popov bound met in practice.
        at.within(
            "feedback.nonlinear.rate_per_mm",
            nonlinear.rate_per_mm,
            0.0,
            3.4 / nonlinear.range_mm,
        )?;
        if let Some(plant) = &self.plant {
            let bound = sector_bound(plant, pid, period_s);
            if nonlinear.largest() > bound {
                let reason = Reason::BeyondPopov { bound };
                return at.refuse(
                    "feedback.nonlinear.rate_per_mm",
                    nonlinear.rate_per_mm,
                    reason,
                );
            }
        }
        Ok(())
    }
}
