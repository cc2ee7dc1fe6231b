//! The one decision on whether a command may start what it asks for.

use core::fmt;

use crate::axes::{AxisName, PerAxis};
use crate::command::Command;
use crate::motion::MotionMode;
use crate::safety::{EnableInterlock, EnabledBy, Fault, FaultCode, SafetyState, Station};

/// The state of the stage, as far as a command depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageView {
    /// The safety state after the last tick.
    pub safety: SafetyState,
    /// A motion is under way.
    pub running: bool,
    /// The bad input that keeps the outputs from being enabled.
    pub interlock: Option<EnableInterlock>,
    /// An axis that moves though the outputs are off.
    pub moving: Option<AxisName>,
    /// A fault that only held the axes.
    pub held: Option<Fault>,
    /// The motion mode of each axis.
    pub modes: PerAxis<MotionMode>,
    /// The axes that know where they are.
    pub homed: PerAxis<bool>,
    /// The axes that start no more than jogs and homing until they are homed.
    pub awaiting_homing: PerAxis<bool>,
    /// The first segments of a stream are there, and start where the axes rest.
    pub stream_ready: bool,
    /// The first value of an injected voltage is there.
    pub injection_ready: bool,
    /// A voltage is being injected.
    pub injecting: bool,
    /// An axis is commissioned, and every axis that its law could drive is: [`StageRef::is_commissioned`].
    ///
    /// [`StageRef::is_commissioned`]: crate::stage::StageRef::is_commissioned
    pub commissioned: bool,
    /// The first axis that has a law and was not commissioned.
    pub uncommissioned: Option<AxisName>,
    /// The axes that nobody has commissioned and that have no law: they do not move.
    pub inert: PerAxis<bool>,
    /// The first inert axis that the plan would move.
    pub inert_planned: Option<AxisName>,
    /// The first inert axis that the first segment of the stream would move.
    pub inert_streamed: Option<AxisName>,
    /// The first inert axis that the plan would move, if the injection that waits starts the plan.
    pub inert_injected: Option<AxisName>,
    /// The holding brake is being released or applied.
    pub brake_moves: bool,
    /// The stations that may enable the outputs.
    pub enabled_by: EnabledBy,
    /// The outputs are kept off while flash is written, or until a restart.
    pub locked: bool,
    /// The stored settings are damaged or were refused, and nobody has stored others since.
    pub settings_invalid: bool,
}

/// Reason why a command is not acted on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A fault is latched; reset it first.
    FaultLatched,
    /// The outputs are off; enable them first.
    NotEnabled,
    /// A motion is under way.
    AlreadyRunning,
    /// There is no fault to reset.
    NoFault,
    /// An input is bad.
    BadInput(EnableInterlock),
    /// The axes brake after a fault.
    Stopping,
    /// No good inputs have been seen yet.
    Starting,
    /// The axis moves already.
    AxisBusy(AxisName),
    /// The axes have no first segment of a stream that starts where they rest.
    NoStream,
    /// There is no injection that could begin.
    NoInjection,
    /// A voltage is being injected.
    Injecting,
    /// No axis is commissioned.
    NotCommissioned,
    /// The axis has a law and is not commissioned.
    LawNotCommissioned(AxisName),
    /// The axis has no law that could move it.
    NoLaw(AxisName),
    /// The holding brake is being released or applied.
    BrakeMoves,
    /// The host alone may enable.
    HostOnly,
    /// The operator at the machine alone may enable.
    OperatorOnly,
    /// The outputs are kept off while flash is written, or until a restart.
    Locked,
    /// The stored settings are damaged or were refused.
    SettingsInvalid,
    /// The axis moves though the outputs are off.
    NotAtStandstill(AxisName),
    /// The axis is not homed, and its settings ask for it.
    NotHomed(AxisName),
}

impl Refusal {
    /// The refusal in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::FaultLatched => "a fault is latched; reset it first",
            Self::NotEnabled => "the outputs are off; enable them first",
            Self::AlreadyRunning => "a motion is under way",
            Self::NoFault => "there is no fault to reset",
            Self::Stopping => "the axes brake after a fault; wait until they stand",
            Self::AxisBusy(_) => "the axis moves already; stop it or wait until it stands",
            Self::NoStream => {
                "there is no stream that starts where the axes rest; open it again and send its first set points"
            }
            Self::NoInjection => {
                "there is no injection to begin; open it again and send its first values"
            }
            Self::Injecting => "a voltage is being injected; stop it or wait until it ends",
            Self::NotCommissioned => {
                "not commissioned: no axis is; run `quadrant commission`, or load a settings file with `commissioned = true`"
            }
            Self::LawNotCommissioned(_) => {
                "the axis has a law, but is not commissioned: commission it, or load settings in which it has none"
            }
            Self::NoLaw(_) => {
                "the axis has no law and cannot move: commission it, or leave it out of the motion"
            }
            Self::BrakeMoves => "the brake is being released or applied; ask again",
            Self::HostOnly => "the host alone may enable (operation.enabled_by)",
            Self::OperatorOnly => {
                "the button at the machine alone enables (operation.enabled_by): hold it"
            }
            Self::Locked => "flash is being written, or a restart is due; ask again",
            Self::SettingsInvalid => {
                "the stored settings are damaged or were refused; check the draft, store it, then reset"
            }
            Self::NotAtStandstill(_) => {
                "the axis moves though the outputs are off; wait until it stands, or find out what moves it"
            }
            Self::NotHomed(_) => {
                "the axis is not homed: until then it jogs and homes at limits.unhomed_mm_s, and nothing else"
            }
            Self::Starting => "the stage has just started; ask again",
            Self::BadInput(interlock) => match interlock.code {
                FaultCode::EmergencyStop => "the emergency stop is pressed; release it",
                FaultCode::AmplifierFault => "the amplifier reports a fault; clear it there",
                FaultCode::OutputMismatch => {
                    "the converter holds another word than was written; check its bus and supply"
                }
                FaultCode::StaleSample => {
                    "the encoder's reading is stale; check the encoder's interface"
                }
                FaultCode::EncoderInvalid => {
                    "the encoder's readings are not valid; check its cable, supply and settings, and the encoder"
                }
                _ => "an input is bad; `inputs` shows which",
            },
        }
    }

    /// The axis that it is about, if it is about one.
    pub const fn axis(&self) -> Option<AxisName> {
        match self {
            Self::BadInput(interlock) => interlock.axis,
            Self::AxisBusy(axis)
            | Self::NotAtStandstill(axis)
            | Self::NotHomed(axis)
            | Self::LawNotCommissioned(axis)
            | Self::NoLaw(axis) => Some(*axis),
            _ => None,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(axis) = self.axis() {
            write!(f, "{axis}: ")?;
        }
        f.write_str(self.as_str())
    }
}

/// Decides if a command from a station is acted on: [`refusal`], and who may enable.
pub fn refusal_from(station: Station, view: StageView, command: Command) -> Option<Refusal> {
    match refusal(view, command) {
        None if command == Command::Enable && !view.enabled_by.allows(station) => {
            Some(match station {
                Station::Host => Refusal::OperatorOnly,
                Station::Operator => Refusal::HostOnly,
            })
        }
        refused => refused,
    }
}

/// Decides if the control law acts on a command now; `None` lets it through. The tick asks, and so do the supervising task
/// and the server, of a stage that is up to ten ticks old: they inform the person who asked.
pub fn refusal(view: StageView, command: Command) -> Option<Refusal> {
    let faulted = matches!(view.safety, SafetyState::Faulted(_));
    let stopping = matches!(view.safety, SafetyState::Stopping(_));
    match command {
        Command::Disable | Command::Stop => None,
        Command::ResetFault if stopping => Some(Refusal::Stopping),
        Command::ResetFault if !faulted => Some(Refusal::NoFault),
        Command::ResetFault if view.settings_invalid => Some(Refusal::SettingsInvalid),
        Command::ResetFault => None,
        _ if faulted => Some(Refusal::FaultLatched),
        _ if stopping => Some(Refusal::Stopping),
        _ if view.brake_moves => Some(Refusal::BrakeMoves),
        Command::Enable if view.safety != SafetyState::Enabled && view.interlock.is_some() => {
            view.interlock.map(Refusal::BadInput)
        }
        Command::Enable if view.safety == SafetyState::Start => Some(Refusal::Starting),
        Command::Enable if view.settings_invalid => Some(Refusal::SettingsInvalid),
        Command::Enable if !view.commissioned => Some(match view.uncommissioned {
            Some(axis) => Refusal::LawNotCommissioned(axis),
            None => Refusal::NotCommissioned,
        }),
        Command::Enable if view.locked => Some(Refusal::Locked),
        Command::Enable if !view.safety.is_enabled() && view.moving.is_some() => {
            view.moving.map(Refusal::NotAtStandstill)
        }
        Command::Enable => None,
        _ if !view.safety.is_enabled() => Some(Refusal::NotEnabled),
        Command::Run | Command::StartStream | Command::StartInjection if view.running => {
            Some(Refusal::AlreadyRunning)
        }
        Command::Run | Command::StartStream | Command::StartInjection
            if view.awaiting_homing.contains(&true) =>
        {
            let awaiting = view.awaiting_homing;
            let first = awaiting.named().find(|(_, awaiting)| **awaiting);
            first.map(|(axis, _)| Refusal::NotHomed(axis))
        }
        Command::Home(axis) | Command::StartMove(axis) | Command::Jog(axis, _)
            if view.inert[axis] =>
        {
            Some(Refusal::NoLaw(axis))
        }
        Command::Run if view.inert_planned.is_some() => view.inert_planned.map(Refusal::NoLaw),
        Command::StartStream if view.inert_streamed.is_some() => {
            view.inert_streamed.map(Refusal::NoLaw)
        }
        Command::StartInjection if view.inert_injected.is_some() => {
            view.inert_injected.map(Refusal::NoLaw)
        }
        Command::StartMove(axis) if view.awaiting_homing[axis] => Some(Refusal::NotHomed(axis)),
        Command::StartStream if !view.stream_ready => Some(Refusal::NoStream),
        Command::StartInjection if !view.injection_ready => Some(Refusal::NoInjection),
        Command::Run | Command::StartStream | Command::StartInjection => None,
        _ if view.injecting => Some(Refusal::Injecting),
        Command::Home(axis) | Command::StartMove(axis) if view.modes[axis] != MotionMode::Hold => {
            Some(Refusal::AxisBusy(axis))
        }
        Command::Jog(axis, _)
            if !matches!(view.modes[axis], MotionMode::Hold | MotionMode::Jog) =>
        {
            Some(Refusal::AxisBusy(axis))
        }
        Command::Home(_) | Command::StartMove(_) | Command::Jog(..) => None,
    }
}
