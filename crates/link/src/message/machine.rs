//! Identity and status of the machine.

use heapless::String;
use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use super::axis::{AxisName, AxisSet};
use super::capture::CapturePhase;
use crate::frame::FrameCounters;

/// The number type of the control law.
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

/// The identity of the server.
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
    /// The number type of the control law.
    pub number: NumberType,
    /// Control ticks since the start.
    pub tick: u32,
}

/// The source of an axis' reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisMode {
    /// None: the reference stands.
    Hold,
    /// A motion of the plan, or a move.
    Plan,
    /// A jog at a velocity.
    Jog,
    /// The homing routine.
    Home,
    /// A stream of set points.
    Stream,
    /// A braking ramp.
    Stopping,
    /// The measured position: a host drives the amplifier.
    OpenLoop,
}

/// The state of the outputs. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum MachineState {
    /// Before the first good inputs.
    Start = 0,
    /// The outputs are off.
    Disabled = 1,
    /// The homing routine of an axis at least. Samples show [`Enabled`](Self::Enabled) then.
    Homing = 2,
    /// The control law drives the outputs.
    Enabled = 3,
    /// The outputs are off until the fault is reset.
    Fault = 4,
    /// The control law drives the outputs while the axes brake after a fault.
    Stopping = 5,
}

impl MachineState {
    /// True if the control law drives the outputs.
    pub const fn drives(self) -> bool {
        matches!(self, Self::Homing | Self::Enabled | Self::Stopping)
    }

    /// Its name in lower case.
    pub fn as_str(self) -> &'static str {
        self.into()
    }
}

/// The active limit of an axis' output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LimitedBy {
    /// None.
    #[default]
    Nothing,
    /// The output limit.
    OutputLimit,
}

/// One axis in a [`Status`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisStatus {
    /// The source of its reference.
    pub mode: AxisMode,
    /// Measured position, mm: from the home position if homed, else from where the axis stood at the start.
    pub position_mm: f64,
    /// Tracking error, mm.
    pub error_mm: f32,
    /// Output, V.
    pub output_v: f32,
    /// The active limit of the output.
    pub limited_by: LimitedBy,
    /// The largest following error since enabling, as a share of its limit; 1 is a fault.
    pub high_mark: f32,
}

/// The status of the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The control tick at which this was true.
    pub tick: u32,
    /// The state of the outputs.
    pub state: MachineState,
    /// The latched fault's number.
    pub fault: Option<u8>,
    /// True while a motion is under way.
    pub running: bool,
    /// The homed axes.
    pub homed: AxisSet,
    /// The axes in order: x, y, z.
    pub axes: [AxisStatus; 3],
    /// Control ticks that ended after their deadline.
    pub overruns: u32,
    /// The longest tick, in cycles of [`Identity::cycle_hz`].
    pub longest_tick_cycles: u32,
    /// Progress of the capture.
    pub capture: CapturePhase,
    /// Frames received.
    pub frames: FrameCounters,
    /// Samples of the present selection that were dropped.
    pub dropped_samples: u32,
    /// Events that were dropped.
    pub dropped_events: u32,
}

impl Status {
    /// True if no motion is under way, nor homing.
    pub fn is_at_rest(&self) -> bool {
        !self.running && self.state != MachineState::Homing
    }
}

/// The digital inputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Inputs {
    /// The control tick at which this was true.
    pub tick: u32,
    /// The inputs that are active: five bits an axis (negative limit, positive limit, home, amplifier fault, output mismatch),
    /// x lowest, and the emergency stop in bit 15.
    pub switches: u16,
    /// The axes whose encoder has shown an index pulse since they were homed last, or since the start.
    pub indexed: AxisSet,
    /// The reason for which the outputs would not be enabled now, with its axis if it is one axis'.
    pub refusal: Option<String<256>>,
}

/// The results of learning of the friction feedforward's scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Learning {
    /// The control tick at which this was true.
    pub tick: u32,
    /// The axes in order, x, y, z: none for one that does not learn.
    pub axes: [Option<AxisLearning>; 3],
}

/// One axis in a [`Learning`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisLearning {
    /// The reason for which the scale is not learnt, or that it is.
    pub state: LearningState,
    /// The scale: friction over what was commissioned.
    pub scale: f32,
    /// The share of the friction before sliding that vibration leaves, 0 to 1.
    pub gate: f32,
    /// RMS error over that without feedforward, the last seconds counting; none before the axis has moved.
    pub error_share: Option<f32>,
}

/// The reason for which the scale of an axis that learns stands, or that it is learnt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum LearningState {
    /// The scale is learnt.
    Learning,
    /// The reference stands.
    AtRest,
    /// The motion is none of the work's: a jog, homing, a controlled stop, an injection.
    OtherMotion,
    /// The output is at its limit.
    Saturated,
    /// The settings were exchanged, or the output was at its limit, a moment ago.
    Settling,
    /// The axis errs more than it would without feedforward: the scale is faded out.
    Fading,
}

impl LearningState {
    /// The state in the words of a person.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Learning => "learning",
            Self::AtRest => "frozen: at rest",
            Self::OtherMotion => "frozen: jog, homing or stop",
            Self::Saturated => "frozen: output at its limit",
            Self::Settling => "frozen: settling",
            Self::Fading => "fading out: no feedforward would do better",
        }
    }
}

/// The digital inputs that a machine has, by name, and the bit of each in [`Inputs::switches`].
pub const INPUTS: [(&str, u16); 13] = [
    ("emergency-stop", 1 << 15),
    ("x.negative-limit", 1 << 0),
    ("x.positive-limit", 1 << 1),
    ("x.home", 1 << 2),
    ("x.amplifier-fault", 1 << 3),
    ("y.negative-limit", 1 << 5),
    ("y.positive-limit", 1 << 6),
    ("y.home", 1 << 7),
    ("y.amplifier-fault", 1 << 8),
    ("z.negative-limit", 1 << 10),
    ("z.positive-limit", 1 << 11),
    ("z.home", 1 << 12),
    ("z.amplifier-fault", 1 << 13),
];

/// A latched fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultReport {
    /// Its stable number.
    pub code: u8,
    /// The axis, if it is one axis' fault.
    pub axis: Option<AxisName>,
    /// The control tick that found it.
    pub tick: u32,
    /// Its name, such as `following-error`.
    pub name: String<32>,
    /// The cause, in one sentence.
    pub cause: String<160>,
    /// The remedy, in one sentence.
    pub remedy: String<224>,
    /// True if its trace was captured and can be read.
    pub captured: bool,
}
