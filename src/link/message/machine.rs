//! What the machine is and how it is.

use heapless::String;
use serde::{Deserialize, Serialize};

use super::motion::AxisSet;
use crate::law::axes::AxisName;
use crate::law::capture::CapturePhase;
use crate::law::motion::MotionMode;
use crate::law::telemetry::{LimitedBy, MachineState};
use crate::link::frame::FrameCounters;

/// What the control law computes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NumberType {
    /// `f32`.
    F32,
    /// Fixed point.
    Fixed,
    /// `f64`: a simulated stage.
    F64,
}

/// Who answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// The protocol's version.
    pub protocol: u8,
    /// The firmware's version.
    pub firmware: String<32>,
    /// The board's name.
    pub board: String<32>,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Rate of the timer that measures ticks, Hz.
    pub cycle_hz: u32,
    /// What the control law computes with.
    pub number: NumberType,
    /// Control ticks since the start.
    pub tick: u32,
}

/// What an axis follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisMode {
    /// Nothing: its reference stands.
    Hold,
    /// A motion of the plan, or a move.
    Plan,
    /// A velocity.
    Jog,
    /// The homing routine.
    Home,
    /// Set points.
    Stream,
    /// A braking ramp.
    Stopping,
    /// The axis itself: a host drives its amplifier.
    OpenLoop,
}

impl From<MotionMode> for AxisMode {
    fn from(mode: MotionMode) -> Self {
        match mode {
            MotionMode::Hold => Self::Hold,
            MotionMode::Plan => Self::Plan,
            MotionMode::Jog => Self::Jog,
            MotionMode::Home => Self::Home,
            MotionMode::Stream => Self::Stream,
            MotionMode::Stopping => Self::Stopping,
            MotionMode::OpenLoop => Self::OpenLoop,
        }
    }
}

/// One axis in a [`Status`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisStatus {
    /// What it follows.
    pub mode: AxisMode,
    /// Measured position, mm: from the home position if homed, else from where the axis stood at the start.
    pub position_mm: f64,
    /// Tracking error, mm.
    pub error_mm: f32,
    /// Output, V.
    pub output_v: f32,
    /// What limits the output.
    pub limited_by: LimitedBy,
    /// The largest following error since enabling, as a share of its limit; 1 is a fault.
    pub high_mark: f32,
}

/// How the machine is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The control tick at which this was true.
    pub tick: u32,
    /// Who drives the outputs.
    pub state: MachineState,
    /// The latched fault's number.
    pub fault: Option<u8>,
    /// Whether a motion is under way.
    pub running: bool,
    /// The axes that know their home position.
    pub homed: AxisSet,
    /// The axes.
    pub axes: [AxisStatus; 3],
    /// Control ticks that ended after their deadline.
    pub overruns: u32,
    /// The longest tick, in cycles of [`Identity::cycle_hz`].
    pub longest_tick_cycles: u32,
    /// How the capture is.
    pub capture: CapturePhase,
    /// Frames received.
    pub frames: FrameCounters,
    /// Samples of the present selection that were dropped.
    pub dropped_samples: u32,
    /// Events that were dropped.
    pub dropped_events: u32,
}

/// A latched fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultReport {
    /// Its stable number.
    pub code: u8,
    /// The axis, if it is one axis' fault.
    pub axis: Option<AxisName>,
    /// The control tick that found it.
    pub tick: u32,
    /// Its name.
    pub name: String<32>,
    /// What happened.
    pub cause: String<160>,
    /// What to do about it.
    pub remedy: String<224>,
    /// Whether its trace was captured and can be read.
    pub captured: bool,
}
