//! Rules of operation that hold for the whole stage: who may enable it, which motions need their host, how it stops.

use super::brake::Brake;
use super::fault::{FaultCode, Reaction};

/// The place that a command comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Station {
    /// The host at the link.
    Host,
    /// The operator at the machine: its button or pendant.
    Operator,
}

/// The stations that may enable the outputs. Every station may always disable them and stop the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(
    feature = "names",
    derive(strum::AsRefStr, strum::EnumString, strum::VariantNames),
    strum(serialize_all = "kebab-case")
)]
pub enum EnabledBy {
    /// The host and the operator.
    #[default]
    Any,
    /// The host alone.
    Host,
    /// The operator alone: the button is an enabling device, and no motion goes on without it.
    Operator,
}

impl EnabledBy {
    /// True if a command to enable is acted on from there.
    pub const fn allows(self, station: Station) -> bool {
        match self {
            Self::Any => true,
            Self::Host => matches!(station, Station::Host),
            Self::Operator => matches!(station, Station::Operator),
        }
    }
}

/// The motions, of those that a host starts, that end when it falls silent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(
    feature = "names",
    derive(strum::AsRefStr, strum::EnumString, strum::VariantNames),
    strum(serialize_all = "kebab-case")
)]
pub enum HostNeeded {
    /// Every motion.
    #[default]
    EveryMotion,
    /// Those without an end of their own, and those that live on what the host sends.
    EndlessMotion,
}

/// Rules of operation of the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operation {
    /// The stations that may enable.
    pub enabled_by: EnabledBy,
    /// The motions that need their host.
    pub host_needed: HostNeeded,
    /// Reaction to the emergency stop: [`Reaction::Off`] or [`Reaction::Stop`].
    pub emergency_stop: Reaction,
    /// Reaction to the loss of the host's signal: [`Reaction::Stop`] or [`Reaction::Hold`].
    pub link_lost: Reaction,
    /// Reaction to a set point that is late: [`Reaction::Stop`] or [`Reaction::Hold`].
    pub underrun: Reaction,
    /// The holding brake.
    pub brake: Brake,
}

impl Operation {
    /// The reaction to a fault under these rules.
    pub const fn reaction(&self, code: FaultCode) -> Reaction {
        match code {
            FaultCode::EmergencyStop => self.emergency_stop,
            FaultCode::LinkLost => self.link_lost,
            FaultCode::StreamUnderrun => self.underrun,
            _ => code.reaction(),
        }
    }
}

impl Default for Operation {
    fn default() -> Self {
        Self {
            enabled_by: EnabledBy::default(),
            host_needed: HostNeeded::default(),
            emergency_stop: FaultCode::EmergencyStop.reaction(),
            link_lost: FaultCode::LinkLost.reaction(),
            underrun: FaultCode::StreamUnderrun.reaction(),
            brake: Brake::default(),
        }
    }
}
