//! What an axis may do, and what happens when it does more.

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, EnumString, VariantNames};

use crate::law::safety::{Reaction, StreamLoss};

/// What an axis may do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct LimitSettings {
    /// Largest velocity of any reference, mm/s; the encoder may move at twice this before it counts as faulty.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration of any reference, mm/s^2.
    pub max_acceleration_mm_s2: f64,
    /// Jerk of jogs and of homing, mm/s^3; 1 to 1e9.
    #[serde(default = "max_jerk_mm_s3")]
    pub max_jerk_mm_s3: f64,
    /// Largest tracking error while the reference stands, mm; beyond it the stage is switched off.
    pub following_error_mm: f64,
    /// What the largest tracking error grows by with the reference's speed, mm per mm/s; 0 to 1.
    #[serde(default = "following_error_lag_s")]
    pub following_error_lag_s: f64,
    /// The most that the largest tracking error grows to, mm; at least that at rest, at most 20.
    #[serde(default = "following_error_max_mm")]
    pub following_error_max_mm: f64,
    /// Measured speed that is a fault, as a multiple of the largest velocity; 1.05 to 2.
    #[serde(default = "overspeed_ratio")]
    pub overspeed_ratio: f64,
    /// Deceleration of a stop after a fault, mm/s^2. Above the largest acceleration, so that a motion that comes to
    /// rest at the end of the travel is not taken for one that will not.
    #[serde(default = "braking_mm_s2")]
    pub braking_mm_s2: f64,
    /// Jerk of that stop, mm/s^3; 1 to 1e9.
    #[serde(default = "braking_jerk_mm_s3")]
    pub braking_jerk_mm_s3: f64,
    /// How long the encoder may show no motion while the output is high, s; one control period to 10.
    #[serde(default = "silent_s")]
    pub silent_s: f64,
    /// From which output on that is, as a share of the output limit; 0.01 to 1.
    #[serde(default = "silent_share")]
    pub silent_share: f64,
    /// The travel, in force once the axis is homed; none: no soft limits.
    #[serde(default)]
    pub travel_mm: Option<TravelSettings>,
}

/// Where an axis may be. The measured position and the end of a stop may lie beyond by half of `following_error_mm`, so
/// that a motion may end on the limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct TravelSettings {
    /// The smallest position, mm; within +-1e4.
    pub negative: f64,
    /// The largest position, mm; above the smallest, at most 1e4.
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

/// What the axes do when set points of a stream no longer come.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, AsRefStr, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum LossReaction {
    /// Brake, switch off, and latch a fault.
    Stop,
    /// Brake and hold.
    Hold,
}

impl From<LossReaction> for Reaction {
    fn from(loss: LossReaction) -> Self {
        match loss {
            LossReaction::Stop => Self::Stop,
            LossReaction::Hold => Self::Hold,
        }
    }
}

/// The stage while a host streams set points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct StreamingSettings {
    /// When the host falls silent.
    #[tree(with = miniconf::leaf)]
    pub link_lost: LossReaction,
    /// When the next set point is late.
    #[tree(with = miniconf::leaf)]
    pub underrun: LossReaction,
}

impl StreamingSettings {
    /// As the tick reads it.
    pub fn build(self) -> StreamLoss {
        StreamLoss {
            link_lost: self.link_lost.into(),
            underrun: self.underrun.into(),
        }
    }
}
