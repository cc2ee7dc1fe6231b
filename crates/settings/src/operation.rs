//! Rules of operation of the whole stage. Ranges and defaults stand in [the table](super::leaves).

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, EnumString, VariantNames};

use quadrant_law::safety::{EnabledBy, HostNeeded, Reaction};

/// The stations that may enable the stage, the motions that need their host, and the reaction to the emergency stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields, default)]
pub struct OperationSettings {
    /// The stations that may enable the outputs.
    #[tree(with = miniconf::leaf)]
    pub enabled_by: EnabledBy,
    /// Motions, of those that a host starts, that end when it falls silent.
    #[tree(with = miniconf::leaf)]
    pub host_needed: HostNeeded,
    /// Reaction to the emergency stop.
    #[tree(with = miniconf::leaf)]
    pub emergency_stop: EmergencyReaction,
}

/// Reaction to the emergency stop, by the categories of IEC 60204-1.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, AsRefStr, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum EmergencyReaction {
    /// Off in the same tick, category 0.
    Off,
    /// Brake under control, then off, category 1.
    Stop,
}

impl From<EmergencyReaction> for Reaction {
    fn from(reaction: EmergencyReaction) -> Self {
        match reaction {
            EmergencyReaction::Off => Self::Off,
            EmergencyReaction::Stop => Self::Stop,
        }
    }
}

/// The holding brake of the stage. Without one, or with one that takes no time, both times are zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields, default)]
pub struct BrakeSettings {
    /// Time from its current to a brake that does not hold, s: no motion starts before.
    pub release_s: f64,
    /// Time from the end of its current to a brake that holds, s: the law holds the axes until then.
    pub apply_s: f64,
}

/// Reactions of the stage while a host moves the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct StreamingSettings {
    /// Reaction when the host falls silent.
    #[tree(with = miniconf::leaf)]
    pub link_lost: LossReaction,
    /// Reaction when the next set point is late.
    #[tree(with = miniconf::leaf)]
    pub underrun: LossReaction,
}

/// Reaction of the axes when set points of a stream no longer come.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, AsRefStr, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum LossReaction {
    /// Brake, switch off, and latch a fault.
    Stop,
    /// Brake under control and hold.
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
