//! Limits of an axis. Ranges and defaults stand in [the table](super::leaves).

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

/// Limits of motion, of the tracking error and of the encoder signal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct LimitSettings {
    /// Largest velocity of any reference, mm/s; the encoder may move at twice this before it counts as faulty.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration of any reference, mm/s^2.
    pub max_acceleration_mm_s2: f64,
    /// Jerk of jogs, moves and homing, mm/s^3.
    #[serde(default = "max_jerk_mm_s3")]
    pub max_jerk_mm_s3: f64,
    /// Largest tracking error while the reference stands, mm; beyond it the stage is switched off.
    pub following_error_mm: f64,
    /// Growth of the largest tracking error with the speed of the reference, mm per mm/s.
    #[serde(default = "following_error_lag_s")]
    pub following_error_lag_s: f64,
    /// Upper bound of the largest tracking error at any speed, mm.
    #[serde(default = "following_error_max_mm")]
    pub following_error_max_mm: f64,
    /// Measured speed that is a fault, as a multiple of the largest velocity.
    #[serde(default = "overspeed_ratio")]
    pub overspeed_ratio: f64,
    /// Deceleration of a stop after a fault, mm/s^2. Above the largest acceleration, so that a motion that comes to
    /// rest at the end of the travel is not taken for one that will not.
    #[serde(default = "braking_mm_s2")]
    pub braking_mm_s2: f64,
    /// Jerk of that stop, mm/s^3.
    #[serde(default = "braking_jerk_mm_s3")]
    pub braking_jerk_mm_s3: f64,
    /// Longest time without encoder motion while the output is above `silent_share`, s.
    #[serde(default = "silent_s")]
    pub silent_s: f64,
    /// Output, as a share of the output limit, above which the encoder must show motion.
    #[serde(default = "silent_share")]
    pub silent_share: f64,
    /// The travel, in force once the axis is homed; none: no soft limits.
    #[serde(default)]
    pub travel_mm: Option<TravelSettings>,
    /// Largest velocity until the axis is homed, mm/s (safely-limited speed, SLS); none: as of a homed axis.
    #[serde(default)]
    pub unhomed_mm_s: Option<f64>,
}

/// Soft limits of an axis. The measured position and the end of a stop may lie beyond by half of `following_error_mm`, so
/// that a motion may end on the limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct TravelSettings {
    /// Smallest position, mm.
    pub negative: f64,
    /// Largest position, mm; above the smallest.
    pub positive: f64,
}

/// Defaults of the fields that a file may lack.
macro_rules! defaults {
    ($($field:ident),+) => {
        $(fn $field() -> f64 {
            LimitSettings::default().$field
        })+
    };
}

defaults!(
    max_jerk_mm_s3,
    following_error_lag_s,
    following_error_max_mm,
    overspeed_ratio,
    braking_mm_s2,
    braking_jerk_mm_s3,
    silent_s,
    silent_share
);
