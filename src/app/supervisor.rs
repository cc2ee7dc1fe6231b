//! The supervising task's decisions: which requests reach the control law, and what a person is told.
//!
//! Runs every [`PERIOD_TICKS`] control ticks, below the control interrupt. Pure, so that the firmware and the host's
//! run of the same job decide alike.

use core::fmt;

use crate::law::axis::{AxisState, CourseMode};
use crate::law::safety::{AxisName, Command, Fault, FaultCode, Obstacle, SafetyState};
use crate::law::scalar::Scalar;
use crate::law::stage::StageState;

/// Control ticks between two runs of the supervisor: 1 kHz at a control rate of 10 kHz.
pub const PERIOD_TICKS: u32 = 10;

/// What the supervisor sees of the stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageView {
    /// Who drives the outputs.
    pub safety: SafetyState,
    /// Whether a motion is under way.
    pub running: bool,
    /// Why the outputs cannot be enabled.
    pub obstacle: Option<Obstacle>,
    /// A fault that only held the axes.
    pub held: Option<Fault>,
    /// What each axis follows.
    pub modes: [CourseMode; 3],
    /// Which axes know where they are.
    pub homed: [bool; 3],
    /// The first segments of a stream are there, and start where the axes rest.
    pub stream_ready: bool,
    /// The first value of an injected voltage is there.
    pub injection_ready: bool,
    /// A voltage is being injected.
    pub injecting: bool,
    /// The settings are those of a commissioning, or of a host. The law cannot tell: the application says so.
    pub commissioned: bool,
}

impl StageView {
    /// What there is to see.
    pub fn of<S: Scalar, const N: usize>(state: &StageState<S, N>) -> Self {
        Self {
            safety: state.safety(),
            running: state.is_running(),
            obstacle: state.obstacle(),
            held: state.held(),
            modes: state.axes().each_ref().map(AxisState::mode),
            homed: state.axes().each_ref().map(AxisState::is_homed),
            stream_ready: state.axes().iter().all(AxisState::is_stream_ready),
            injection_ready: state.is_injection_ready(),
            injecting: state.is_injecting(),
            commissioned: true,
        }
    }
}

/// Why a request did not reach the control law.
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
    BadInput(Obstacle),
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
    /// The settings are the default ones, which hold no law.
    NotCommissioned,
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
                "not commissioned: no axis has a law; run `quadrant commission`, or load a settings file"
            }
            Self::Starting => "the stage has just started; ask again",
            Self::BadInput(obstacle) => match obstacle.code {
                FaultCode::EmergencyStop => "the emergency stop is pressed; release it",
                FaultCode::AmplifierFault => "the amplifier reports a fault; clear it there",
                FaultCode::OutputMismatch => {
                    "the converter holds another word than was written; check its bus and supply"
                }
                FaultCode::StaleSample => {
                    "the encoder's reading is stale; check the encoder's interface"
                }
                FaultCode::EncoderInvalid => {
                    "both lines of the encoder change at once; check its cable and supply"
                }
                other => other.cause(),
            },
        }
    }

    /// The axis that it is about, if it is about one.
    pub const fn axis(&self) -> Option<AxisName> {
        match self {
            Self::BadInput(obstacle) => obstacle.axis,
            Self::AxisBusy(axis) => Some(*axis),
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

/// Something a person should read in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The outputs were switched on.
    Enabled,
    /// The outputs were switched off.
    Disabled,
    /// A fault was found, and the axes brake under control.
    Stopping(Fault),
    /// A fault switched the outputs off.
    Faulted(Fault),
    /// A fault was found, and the axes brake and hold.
    Held(Fault),
    /// The plan's motions began.
    MotionStarted,
    /// The plan's motions came to their end.
    MotionFinished,
    /// A request was refused.
    Refused(Command, Refusal),
}

/// The supervisor's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervisor {
    seen: StageView,
}

/// What one run of the supervisor decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decision {
    /// For the control law's next tick.
    pub command: Option<Command>,
    /// For the log: a change of state, a change of motion, a refusal.
    pub events: [Option<Event>; 4],
}

impl Supervisor {
    /// Looks at the stage and at a request, if there is one.
    pub fn step(&mut self, view: StageView, request: Option<Command>) -> Decision {
        let seen = core::mem::replace(&mut self.seen, view);
        let state = match view.safety {
            _ if seen.safety == view.safety => None,
            SafetyState::Start => None,
            // That a start is over is no news: nothing has changed for the outputs.
            SafetyState::Disabled if seen.safety == SafetyState::Start => None,
            SafetyState::Disabled => Some(Event::Disabled),
            SafetyState::Enabled => Some(Event::Enabled),
            SafetyState::Stopping(fault) => Some(Event::Stopping(fault)),
            SafetyState::Faulted(fault) => Some(Event::Faulted(fault)),
        };
        let held = match view.held {
            Some(fault) if seen.held != view.held => Some(Event::Held(fault)),
            _ => None,
        };
        let motion = match (seen.running, view.running) {
            (false, true) => Some(Event::MotionStarted),
            (true, false) if view.safety.is_enabled() => Some(Event::MotionFinished),
            _ => None,
        };
        let refusal = request.and_then(|command| {
            refusal(view, command).map(|reason| Event::Refused(command, reason))
        });
        Decision {
            command: if refusal.is_none() { request } else { None },
            events: [state, held, motion, refusal],
        }
    }
}

/// Why the control law would not act on a command now, as far as `view` tells.
pub fn refusal(view: StageView, command: Command) -> Option<Refusal> {
    let faulted = matches!(view.safety, SafetyState::Faulted(_));
    let stopping = matches!(view.safety, SafetyState::Stopping(_));
    match command {
        Command::Disable | Command::Stop => None,
        Command::ResetFault if stopping => Some(Refusal::Stopping),
        Command::ResetFault if !faulted => Some(Refusal::NoFault),
        Command::ResetFault => None,
        _ if faulted => Some(Refusal::FaultLatched),
        _ if stopping => Some(Refusal::Stopping),
        Command::Enable if view.safety != SafetyState::Enabled && view.obstacle.is_some() => {
            view.obstacle.map(Refusal::BadInput)
        }
        Command::Enable if view.safety == SafetyState::Start => Some(Refusal::Starting),
        Command::Enable if !view.commissioned => Some(Refusal::NotCommissioned),
        Command::Enable => None,
        _ if !view.safety.is_enabled() => Some(Refusal::NotEnabled),
        Command::Run | Command::StartStream | Command::StartInjection if view.running => {
            Some(Refusal::AlreadyRunning)
        }
        Command::StartStream if !view.stream_ready => Some(Refusal::NoStream),
        Command::StartInjection if !view.injection_ready => Some(Refusal::NoInjection),
        Command::Run | Command::StartStream | Command::StartInjection => None,
        _ if view.injecting => Some(Refusal::Injecting),
        Command::Home(axis) | Command::StartMove(axis) if mode(view, axis) != CourseMode::Hold => {
            Some(Refusal::AxisBusy(axis))
        }
        Command::Jog(axis, _)
            if !matches!(mode(view, axis), CourseMode::Hold | CourseMode::Jog) =>
        {
            Some(Refusal::AxisBusy(axis))
        }
        Command::Home(_) | Command::StartMove(_) | Command::Jog(..) => None,
    }
}

/// What an axis follows.
fn mode(view: StageView, axis: AxisName) -> CourseMode {
    let [x, y, z] = view.modes;
    match axis {
        AxisName::X => x,
        AxisName::Y => y,
        AxisName::Z => z,
    }
}
