//! Samples: while they are taken, and around a trigger.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::law::capture::{CapturePhase, CaptureRecord, Trigger};
use crate::law::telemetry::{Channel, MAX_CHANNELS, Words};

/// What is asked of the telemetry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TelemetryRequest {
    /// Send samples; another selection ends.
    Select {
        /// The channels.
        channels: Vec<Channel, MAX_CHANNELS>,
        /// Control ticks from one sample to the next; at least 1.
        decimation: u16,
    },
    /// Send no more.
    Stop,
}

/// What is asked of the capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum CaptureRequest {
    /// Forget what was captured and wait for a trigger.
    Arm {
        /// The channels.
        channels: Vec<Channel, MAX_CHANNELS>,
        /// Control ticks from one sample to the next; at least 1.
        decimation: u16,
        /// Share of the ring for what comes before the trigger, percent; 0 to 100.
        pre_trigger_percent: u8,
        /// What to wait for.
        trigger: Trigger,
    },
    /// Freeze what there is.
    Disarm,
    /// How far has it come?
    State,
    /// The words from an offset on.
    Read {
        /// Words before the first one asked for.
        offset: u16,
    },
}

/// How the capture is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureStatus {
    /// How far it has come.
    pub phase: CapturePhase,
    /// How often it was armed since the start; wraps. Pages of one capture are read under one number.
    pub number: u16,
    /// What is recorded.
    pub channels: Vec<Channel, MAX_CHANNELS>,
    /// Control ticks from one sample to the next; 0 before it was first armed.
    pub decimation: u16,
    /// What was recorded, if it is frozen.
    pub record: Option<CaptureRecord>,
}

/// Some of the capture's words: sample after sample, the oldest first. None at or behind the end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WordPage {
    /// The capture's number, as in [`CaptureStatus::number`].
    pub number: u16,
    /// Words before the first of these.
    pub offset: u16,
    /// The words.
    pub words: Words,
}
