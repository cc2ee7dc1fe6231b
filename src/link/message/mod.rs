//! The messages: requests of a client, responses and notices of a server.
//!
//! Every type bounds its size, and the largest message fits a frame
//! ([`PAYLOAD_BYTES`](super::frame::PAYLOAD_BYTES)). The order of variants and fields **is** the wire format: what is new
//! goes to the end of an enum, and any other change needs another [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION). What a
//! client needs to be told of another version never changes: the version byte, a request's number before its body,
//! `Response` as the first message, and `Version` as the first error.

mod error;
mod inject;
mod machine;
mod motion;
mod notice;
mod observe;
mod settings;
mod text;

pub use error::LinkError;
pub use inject::{INJECT_VALUES, InjectRequest, InjectStatus, Voltages};
pub use machine::{AxisMode, AxisStatus, FaultReport, Identity, NumberType, Status};
pub use motion::{AxisPoint, AxisSet, STREAM_POINTS, SetPoint, StreamRequest, StreamStatus};
pub use notice::{Event, Notice};
pub use observe::{CaptureRequest, CaptureStatus, TelemetryRequest, WordPage};
pub use settings::{Applied, PAGE_PATHS, Path, PathPage, Provenance, SettingsRequest, Value};
pub use text::{Text, text};

use serde::{Deserialize, Serialize};

use crate::law::axes::AxisName;
use crate::settings::PlanSettings;

/// What a client asks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// The client's number for it; its response has the same.
    pub id: u16,
    /// What is asked.
    pub body: Body,
}

/// What a request asks for. The reply is [`Reply::Done`] where no other is named.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Body {
    /// Opens the session: who is there? [`Reply::Identity`].
    Hello,
    /// How is the machine? [`Reply::Status`].
    Status,
    /// Which fault is latched? [`Reply::Fault`].
    Fault,
    /// Clear the latched fault.
    ResetFault,
    /// Switch the outputs on, holding the present position.
    Enable,
    /// Switch the outputs off.
    Disable,
    /// Brake to rest and stay enabled.
    Stop,
    /// Find the home position of these axes.
    Home(AxisSet),
    /// Move one axis to a position.
    Move {
        /// The axis.
        axis: AxisName,
        /// Where to, mm from the home position.
        target_mm: f64,
        /// How fast at most, mm/s; above zero, at most the axis' limit.
        velocity_mm_s: f64,
    },
    /// Move one axis at a velocity until told otherwise, or until its host falls silent.
    Jog {
        /// The axis.
        axis: AxisName,
        /// The velocity, mm/s, with its sign; zero brakes.
        velocity_mm_s: f64,
    },
    /// Start the plan's motions.
    Run,
    /// Exchange the plan.
    SetPlan(PlanSettings),
    /// Set points. [`Reply::Stream`].
    Stream(StreamRequest),
    /// The settings. [`Reply::Value`], [`Reply::Paths`], [`Reply::Applied`] or [`Reply::Provenance`].
    Settings(SettingsRequest),
    /// Samples while they are taken. [`Reply::Telemetry`].
    Telemetry(TelemetryRequest),
    /// Samples around a trigger. [`Reply::Capture`] or [`Reply::Words`].
    Capture(CaptureRequest),
    /// Start afresh, as after power-up.
    Reboot,
    /// A voltage added to an axis' output. [`Reply::Inject`].
    Inject(InjectRequest),
}

impl Body {
    /// Its name, for a log.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Hello => "hello",
            Self::Status => "status",
            Self::Fault => "fault",
            Self::ResetFault => "reset-fault",
            Self::Enable => "enable",
            Self::Disable => "disable",
            Self::Stop => "stop",
            Self::Home(_) => "home",
            Self::Move { .. } => "move",
            Self::Jog { .. } => "jog",
            Self::Run => "run",
            Self::SetPlan(_) => "set-plan",
            Self::Stream(_) => "stream",
            Self::Settings(_) => "settings",
            Self::Telemetry(_) => "telemetry",
            Self::Capture(_) => "capture",
            Self::Reboot => "reboot",
            Self::Inject(_) => "inject",
        }
    }

    /// Whether it may set the machine in motion, or let it be set in motion.
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

    /// Refuses a number of a motion that is infinite or none: those never get further than the link.
    #[inline(never)]
    pub fn check(&self) -> Result<(), LinkError> {
        // Says what the number is without the formatting of floats, which takes kilobytes of flash.
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

/// What a server sends.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// The answer to a request.
    Response(Response),
    /// What nobody asked for at this moment.
    Notice(Notice),
}

/// The answer to a request; every request gets one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The request's number.
    pub id: u16,
    /// What came of it.
    pub result: Result<Reply, LinkError>,
}

/// What a server replies with.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// It was done, or will be at the next tick.
    Done,
    /// Who the server is.
    Identity(Identity),
    /// How the machine is.
    Status(Status),
    /// The latched fault, if there is one.
    Fault(Option<FaultReport>),
    /// How far the stream of set points has come.
    Stream(StreamStatus),
    /// The value of a setting, in postcard.
    Value(Value),
    /// Some of the settings' paths.
    Paths(PathPage),
    /// What applying the settings changed.
    Applied(Applied),
    /// Where the stored settings came from.
    Provenance(Provenance),
    /// The generation of the blocks that will come.
    Telemetry {
        /// As in [`TelemetryBlock::generation`](crate::law::telemetry::TelemetryBlock::generation).
        generation: u8,
    },
    /// How the capture is.
    Capture(CaptureStatus),
    /// Some of the capture's words.
    Words(WordPage),
    /// How far an injected voltage has come.
    Inject(InjectStatus),
}
