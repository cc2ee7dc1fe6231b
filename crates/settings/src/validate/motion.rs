//! Checks of motions against their axes' limits.

use super::Place;
use crate::axis::AxisSettings;
use crate::error::SettingsError;
use crate::leaves::limits::{LONGEST_TRAVEL_MM, MOST_ACCELERATION_MM_S2, MOST_JERK_MM_S3};
use crate::stage::{PlanSettings, StageSettings};
use quadrant_law::axes::AxisName;
use quadrant_law::reference::MotionSettings;
use quadrant_law::units::FASTEST_MM_S;

/// The longest travel of a motion, in counts: what the references' products hold.
const MOST_TRAVEL_COUNTS: f64 = 1_073_741_824.0;

/// The longest motion that ends, in ticks: half of what the tick counter holds.
const MOST_TICKS: f64 = 2e9;

impl PlanSettings {
    /// Checks every motion against its axis' limits.
    ///
    /// # Errors
    /// The first field that is refused.
    pub fn validate(&self, stage: &StageSettings) -> Result<(), SettingsError> {
        for ((name, axis), motion) in AxisName::ALL
            .into_iter()
            .zip(&stage.axes)
            .zip(&self.motions)
        {
            validate_motion(Place { axis: Some(name) }, motion, axis, stage.rate_hz)?;
        }
        Ok(())
    }
}

fn validate_motion(
    at: Place,
    motion: &MotionSettings,
    axis: &AxisSettings,
    rate_hz: f64,
) -> Result<(), SettingsError> {
    let longest = (MOST_TRAVEL_COUNTS * axis.encoder.resolution_mm).min(LONGEST_TRAVEL_MM);
    match motion {
        MotionSettings::Hold => return Ok(()),
        MotionSettings::Harmonic(sine) => {
            at.within("motion.amplitude_mm", sine.amplitude_mm, 1e-6, longest)?;
            at.within(
                "motion.frequency_hz",
                sine.frequency_hz,
                1e-6,
                rate_hz / 20.0,
            )?;
            at.within("motion.phase_rad", sine.phase_rad, -100.0, 100.0)?;
            if let Some(cycles) = sine.cycles {
                let most = MOST_TICKS / rate_hz * sine.frequency_hz;
                at.within("motion.cycles", cycles, 0.0, most)?;
            }
            at.within("motion.lead_s", sine.lead_s, 1.0 / rate_hz, 100.0)?;
        }
        MotionSettings::PointToPoint(to) => {
            at.within("motion.distance_mm", to.distance_mm, -longest, longest)?;
            at.within(
                "motion.max_jerk_mm_s3",
                to.max_jerk_mm_s3,
                1e-3,
                MOST_JERK_MM_S3,
            )?;
            at.within(
                "motion.max_velocity_mm_s",
                to.max_velocity_mm_s,
                1e-6,
                FASTEST_MM_S,
            )?;
            at.within(
                "motion.max_acceleration_mm_s2",
                to.max_acceleration_mm_s2,
                1e-3,
                MOST_ACCELERATION_MM_S2,
            )?;
            let most = MOST_TICKS / rate_hz;
            at.within("motion (duration, s)", to.duration_s(), 0.0, most)?;
        }
    }
    let (velocity, acceleration) = motion.peaks();
    at.within(
        "motion (peak velocity, mm/s)",
        velocity,
        0.0,
        axis.limits.max_velocity_mm_s,
    )?;
    at.within(
        "motion (peak acceleration, mm/s^2)",
        acceleration,
        0.0,
        axis.limits.max_acceleration_mm_s2,
    )
}
