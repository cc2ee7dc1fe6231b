//! The capture's trigger, progress and record.

use serde::{Deserialize, Serialize};

use super::channel::Channel;

/// The direction in which a level is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// From below the level to it or above.
    Rising,
    /// From above the level to it or below.
    Falling,
    /// In either direction.
    Either,
}

/// A level of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// The channel, whether it is recorded or not.
    pub channel: Channel,
    /// The direction in which it is crossed.
    pub edge: Edge,
    /// The level, in the channel's unit: finite; rounded to `f32`, or to the integers of a channel of integers.
    pub level: f64,
}

/// The trigger of a capture. A fault triggers it in any case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trigger {
    /// The first tick.
    Now,
    /// The next command that reaches the control law.
    Command,
    /// The next fault.
    Fault,
    /// A channel that crosses a level.
    Level(Level),
    /// An axis that begins to move while none did.
    MotionStart,
}

/// The event that froze a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaptureCause {
    /// It was stopped by hand.
    Stopped,
    /// The first tick: it waited for nothing.
    Now,
    /// A command reached the control law.
    Command,
    /// A fault was found.
    Fault,
    /// A level was crossed.
    Level,
    /// A motion began.
    MotionStart,
}

/// Progress of a capture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CapturePhase {
    /// It was never armed.
    #[default]
    Idle,
    /// Recording, waiting for its trigger.
    Armed,
    /// Recording what comes after the trigger.
    Triggered,
    /// Recorded; ready to be read.
    Frozen,
}

/// Description of a frozen capture's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureRecord {
    /// Number of samples.
    pub samples: u32,
    /// Index of the first sample at or after the trigger.
    pub trigger_sample: u32,
    /// The control tick of the first sample.
    pub first_tick: u32,
    /// The control tick of the trigger.
    pub trigger_tick: u32,
    /// The event that froze it.
    pub cause: CaptureCause,
}
