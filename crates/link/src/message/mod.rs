//! The messages: requests of a client, responses and notices of a server.
//!
//! Every type bounds its size, and the largest message fits a frame
//! ([`PAYLOAD_BYTES`](super::frame::PAYLOAD_BYTES)). The order of variants and fields **is** the wire format: what is new
//! goes to the end of an enum, and any other change needs another [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION). What a
//! client needs to know of another version never changes: the version byte, a request's number before its body,
//! `Response` as the first message, and `Version` as the first error.

mod axis;
mod capture;
mod channel;
mod error;
mod inject;
mod machine;
mod motion;
mod notice;
mod observe;
mod settings;
mod text;

pub use axis::{AxisName, AxisSet, UnknownAxes};
pub use capture::{CaptureCause, CapturePhase, CaptureRecord, Edge, Level, Trigger};
pub use channel::{AxisSignal, Channel, StageSignal, UnknownChannel, WordKind};
pub use error::LinkError;
pub use inject::{INJECT_VALUES, InjectRequest, InjectStatus, Voltages};
pub use machine::{
    AxisLearning, AxisMode, AxisStatus, FaultReport, INPUTS, Identity, Inputs, Learning,
    LearningState, LimitedBy, MachineState, NumberType, Status,
};
pub use motion::{
    AxisPoint, Harmonic, Motion, Plan, PointToPoint, STREAM_POINTS, SetPoint, StreamRequest,
    StreamStatus,
};
pub use notice::{Event, Notice, OscillationKind};
pub use observe::{
    BLOCK_BYTES, BLOCK_WORDS, CaptureRequest, CaptureStatus, LOG_PAGE_BYTES, LogPage, MAX_CHANNELS,
    SERIAL_VALUES_PER_S, SampleWords, TelemetryBlock, TelemetryRequest, WordPage,
};
pub use settings::{
    Applied, MAX_VALUE_BYTES, PAGE_PATHS, Path, PathPage, Provenance, SettingsRequest, Value,
};
pub use text::{Text, text};

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

/// A message of a client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// The client's number for it; its response has the same.
    pub id: u16,
    /// The request itself.
    pub body: Body,
}

/// The content of a request. The reply is [`Reply::Done`] where no other is named.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Body {
    /// Opens the session and asks for the server's identity. [`Reply::Identity`].
    Hello,
    /// Asks for the machine's status. [`Reply::Status`].
    Status,
    /// Asks for the latched fault. [`Reply::Fault`].
    Fault,
    /// Clears the latched fault.
    ResetFault,
    /// Switches the outputs on, holding the present position.
    Enable,
    /// Switches the outputs off.
    Disable,
    /// Brakes to rest and stays enabled.
    Stop,
    /// Homes these axes.
    Home(AxisSet),
    /// Moves one axis to a position.
    Move {
        /// The axis.
        axis: AxisName,
        /// Target, mm from the home position.
        target_mm: f64,
        /// Largest velocity, mm/s; above zero, at most the axis' limit.
        velocity_mm_s: f64,
    },
    /// Moves one axis at a velocity until another command comes, or until its host falls silent.
    Jog {
        /// The axis.
        axis: AxisName,
        /// The velocity, mm/s, with its sign; zero brakes.
        velocity_mm_s: f64,
    },
    /// Starts the plan's motions.
    Run,
    /// Replaces the plan.
    SetPlan(Plan),
    /// A request about the stream of set points. [`Reply::Stream`].
    Stream(StreamRequest),
    /// A request about the settings. [`Reply::Value`], [`Reply::Paths`], [`Reply::Applied`] or [`Reply::Provenance`].
    Settings(SettingsRequest),
    /// A request about telemetry, samples sent as they are taken. [`Reply::Telemetry`].
    Telemetry(TelemetryRequest),
    /// A request about the capture, samples around a trigger. [`Reply::Capture`] or [`Reply::Words`].
    Capture(CaptureRequest),
    /// Restarts the firmware, as after power-up.
    Reboot,
    /// A request about a voltage added to an axis' output. [`Reply::Inject`].
    Inject(InjectRequest),
    /// Asks for the digital inputs, and for what keeps the outputs from being enabled. [`Reply::Inputs`].
    Inputs,
    /// Asks for what the axes have learnt. [`Reply::Learning`].
    Learning,
    /// Sets the speed of the spindle, by which the vibration of a cut is cancelled.
    Spindle {
        /// The speed, rpm, 0 to 1 000 000; zero if it stands.
        rpm: f64,
    },
    /// Asks for bytes of the log. [`Reply::Log`].
    Log {
        /// Number of the first byte, counted since the start; wraps.
        from: u32,
    },
}

impl Body {
    /// Its name in lower case, such as `set-plan`.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// True if it may set the machine in motion, or let it be set in motion.
    pub const fn may_move(&self) -> bool {
        matches!(
            self,
            Self::Enable
                | Self::Home(_)
                | Self::Move { .. }
                | Self::Jog { .. }
                | Self::Run
                | Self::Stream(_)
                | Self::Inject(_)
        )
    }

    /// Checks that the numbers of a motion are finite: others never get further than the link.
    ///
    /// # Errors
    /// Names the first field that is infinite or NaN.
    #[inline(never)]
    pub fn check(&self) -> Result<(), LinkError> {
        // Names the number without the formatting of floats, which takes kilobytes of flash.
        let kind = |value: f64| match value.is_nan() {
            true => "NaN",
            false => "infinite",
        };
        let finite = |field, value: f64| match value.is_finite() {
            true => Ok(()),
            false => Err(LinkError::Invalid(text(format_args!(
                "{field}: is {}; give a finite number in the unit that the name ends with",
                kind(value)
            )))),
        };
        match self {
            Self::Move {
                target_mm,
                velocity_mm_s,
                ..
            } => {
                finite("target_mm", *target_mm)?;
                finite("velocity_mm_s", *velocity_mm_s)?;
            }
            Self::Jog { velocity_mm_s, .. } => finite("velocity_mm_s", *velocity_mm_s)?,
            Self::Spindle { rpm } => finite("rpm", *rpm)?,
            Self::Stream(StreamRequest::Points { points, .. }) => {
                for axis in points.iter().flat_map(|point| &point.axes) {
                    finite("position_mm", axis.position_mm)?;
                    finite("velocity_mm_s", f64::from(axis.velocity_mm_s))?;
                    finite("acceleration_mm_s2", f64::from(axis.acceleration_mm_s2))?;
                }
            }
            Self::Inject(InjectRequest::Open {
                limit_v,
                travel_mm,
                max_velocity_mm_s,
                ..
            }) => {
                finite("limit_v", *limit_v)?;
                finite("travel_mm", *travel_mm)?;
                finite("max_velocity_mm_s", *max_velocity_mm_s)?;
            }
            _ => {}
        }
        Ok(())
    }
}

/// A message of a server.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// The answer to a request.
    Response(Response),
    /// A message that no request asked for.
    Notice(Notice),
}

/// The answer to a request; every request gets one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The request's number.
    pub id: u16,
    /// The reply, or the reason for which the request was not done.
    pub result: Result<Reply, LinkError>,
}

/// The content of a response.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// It was done, or will be at the next tick.
    Done,
    /// The identity of the server.
    Identity(Identity),
    /// The status of the machine.
    Status(Status),
    /// The latched fault, if there is one.
    Fault(Option<FaultReport>),
    /// Progress of the stream of set points.
    Stream(StreamStatus),
    /// The value of a setting, in postcard.
    Value(Value),
    /// A page of the settings' paths.
    Paths(PathPage),
    /// The effect of applying the settings.
    Applied(Applied),
    /// The origin of the stored settings.
    Provenance(Provenance),
    /// The generation of the blocks that will come.
    Telemetry {
        /// As in [`TelemetryBlock::generation`].
        generation: u8,
    },
    /// The status of the capture.
    Capture(CaptureStatus),
    /// A page of the capture's words.
    Words(WordPage),
    /// Progress of an injected voltage.
    Inject(InjectStatus),
    /// The digital inputs.
    Inputs(Inputs),
    /// The result of learning.
    Learning(Learning),
    /// A page of the log.
    Log(LogPage),
}
