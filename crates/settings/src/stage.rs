//! The settings of the whole stage, and of its motions.

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

use super::axis::AxisSettings;
use super::operation::{BrakeSettings, OperationSettings, StreamingSettings};
use quadrant_law::reference::MotionSettings;

/// Everything the stage's control law is made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct StageSettings {
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Rules of operation.
    #[serde(default)]
    pub operation: OperationSettings,
    /// The holding brake.
    #[serde(default)]
    pub brake: BrakeSettings,
    /// Reactions when set points of a stream no longer come.
    #[serde(default)]
    pub streaming: StreamingSettings,
    /// x, y, z.
    pub axes: [AxisSettings; 3],
}

/// The motions of the three axes, started together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanSettings {
    /// One motion an axis.
    pub motions: [MotionSettings; 3],
}

/// Settings and motions of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// The settings.
    pub stage: StageSettings,
    /// The plan's motions.
    pub plan: PlanSettings,
}
