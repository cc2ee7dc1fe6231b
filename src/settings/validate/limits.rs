//! Checks of what an axis may do.

use super::{LONGEST_TRAVEL_MM, Place};
use crate::settings::{AxisSettings, SettingsError};

/// The fastest reference, in counts per tick: what the formats of the moves' velocity and of the displacement hold.
const MOST_COUNTS_PER_TICK: f64 = 4096.0;
/// The largest acceleration of a reference, in counts per tick squared: what the format of the moves' holds.
const MOST_COUNTS_PER_TICK_SQUARED: f64 = 256.0;
/// The largest limit of the tracking error, in counts: half of where the error saturates.
const MOST_ERROR_COUNTS: f64 = 8_388_608.0;

impl AxisSettings {
    pub(super) fn validate_limits(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let limits = &self.limits;
        let resolution = self.encoder.resolution_mm;
        // The encoder may move twice as far, within half of its counter's range, or its direction is lost.
        let half_range = libm::scalbn(0.5, self.encoder.counter_bits.into());
        let fastest = (0.5 * half_range).min(MOST_COUNTS_PER_TICK) * resolution / period_s;
        let most_acceleration = MOST_COUNTS_PER_TICK_SQUARED * resolution / (period_s * period_s);
        at.within(
            "limits.max_velocity_mm_s",
            limits.max_velocity_mm_s,
            1e-3,
            fastest.min(1e3),
        )?;
        at.within(
            "limits.max_acceleration_mm_s2",
            limits.max_acceleration_mm_s2,
            1e-3,
            most_acceleration.min(3e4),
        )?;
        let largest_error = (MOST_ERROR_COUNTS * resolution).min(20.0);
        let at_rest = limits.following_error_mm;
        at.within(
            "limits.following_error_mm",
            at_rest,
            resolution,
            largest_error,
        )?;
        let field = "limits.following_error_lag_s";
        at.within(field, limits.following_error_lag_s, 0.0, 1.0)?;
        let field = "limits.following_error_max_mm";
        at.within(field, limits.following_error_max_mm, at_rest, largest_error)?;
        at.within("limits.overspeed_ratio", limits.overspeed_ratio, 1.05, 2.0)?;
        let field = "limits.braking_mm_s2";
        at.within(
            field,
            limits.braking_mm_s2,
            1e-3,
            most_acceleration.min(3e4),
        )?;
        at.within("limits.max_jerk_mm_s3", limits.max_jerk_mm_s3, 1.0, 1e9)?;
        let field = "limits.braking_jerk_mm_s3";
        at.within(field, limits.braking_jerk_mm_s3, 1.0, 1e9)?;
        at.within("limits.silent_s", limits.silent_s, period_s, 10.0)?;
        at.within("limits.silent_share", limits.silent_share, 0.01, 1.0)?;
        let Some(travel) = &limits.travel_mm else {
            return Ok(());
        };
        let field = "limits.travel_mm.negative";
        at.within(
            field,
            travel.negative,
            -LONGEST_TRAVEL_MM,
            LONGEST_TRAVEL_MM,
        )?;
        let field = "limits.travel_mm.positive";
        at.within(
            field,
            travel.positive,
            travel.negative + resolution,
            LONGEST_TRAVEL_MM,
        )
    }
}
