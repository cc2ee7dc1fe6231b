//! Three axes, one tick: a pure function of settings, memory and inputs.

mod injection;
mod io;

pub use io::{Inputs, Outputs};

use crate::law::axis::{Axis, AxisState};
use crate::law::friction::gms::FIRMWARE_ELEMENTS;
use crate::law::injection::InjectionState;
use crate::law::reference::{Motion, Segment};
use crate::law::safety::{
    AxisName, Command, Fault, FaultCode, Obstacle, Reaction, SafetyState, StreamLoss, Switches,
};
use crate::law::scalar::Scalar;
use crate::law::units::DacCode;

/// Ticks from the end of the braking ramps to switching off: the preview has passed, and the axes have caught up.
const SETTLING_TICKS: u32 = 200;

/// The motions that the axes run together.
pub type Plan<S> = [Motion<S>; 3];

/// The stage ready for the tick; `N` is the room for GMS elements. Made by
/// [`StageSettings::build`](crate::settings::StageSettings::build).
#[derive(Clone, Debug, PartialEq)]
pub struct Stage<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    pub(crate) axes: [Axis<S, N>; 3],
    pub(crate) streaming: StreamLoss,
}

/// A stage in pieces, so that one axis can be exchanged without moving the others.
#[derive(Clone, Copy, Debug)]
pub struct StageRef<'a, S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    /// The axes.
    pub axes: [&'a Axis<S, N>; 3],
    /// What happens when set points no longer come.
    pub streaming: StreamLoss,
}

/// The memory of the stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageState<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    axes: [AxisState<S, N>; 3],
    safety: SafetyState,
    tick: u32,
    obstacle: Option<Obstacle>,
    held: Option<Fault>,
    /// Ticks since the axes came to rest after a fault.
    settled: u32,
    pub(super) injection: InjectionState<S>,
}

impl<S: Scalar, const N: usize> Default for StageState<S, N> {
    fn default() -> Self {
        Self {
            axes: core::array::from_fn(|_| AxisState::default()),
            safety: SafetyState::default(),
            tick: 0,
            obstacle: None,
            held: None,
            settled: 0,
            injection: InjectionState::default(),
        }
    }
}

impl<S: Scalar, const N: usize> StageState<S, N> {
    /// A stage that starts with a fault latched: what the last run or the stored settings left.
    pub fn with_fault(code: FaultCode) -> Self {
        let mut state = Self::default();
        state.start_faulted(code);
        state
    }

    /// As [`with_fault`](Self::with_fault), for a stage that has not ticked yet.
    pub fn start_faulted(&mut self, code: FaultCode) {
        self.safety = SafetyState::Faulted(Fault {
            code,
            axis: None,
            tick: 0,
        });
    }

    /// The axes' memories.
    pub fn axes(&self) -> &[AxisState<S, N>; 3] {
        &self.axes
    }

    /// Who drives the outputs.
    pub fn safety(&self) -> SafetyState {
        self.safety
    }

    /// Control ticks so far; wraps after five days at 10 kHz.
    pub const fn tick(&self) -> u32 {
        self.tick
    }

    /// Why the outputs cannot be enabled at present, if an input is bad.
    pub fn obstacle(&self) -> Option<Obstacle> {
        self.obstacle
    }

    /// The last fault that only held the axes ([`Reaction::Hold`]), until the next motion.
    pub fn held(&self) -> Option<Fault> {
        self.held
    }

    /// Whether any motion is under way.
    pub fn is_running(&self) -> bool {
        self.injection.is_running() || self.axes.iter().any(AxisState::is_running)
    }

    /// Gives an axis the next segment of a stream; call it when [`AxisState::wants_segment`].
    #[inline(always)]
    pub fn offer_segment(&mut self, axis: AxisName, segment: Segment) {
        let [x, y, z] = &mut self.axes;
        match axis {
            AxisName::X => x.offer_segment(segment),
            AxisName::Y => y.offer_segment(segment),
            AxisName::Z => z.offer_segment(segment),
        }
    }

    /// Puts an axis' travel into force, or out of it: for encoders that know where they are. Homing does it by itself.
    pub fn set_homed(&mut self, axis: AxisName, homed: bool) {
        match axis {
            AxisName::X => self.axes[0].set_homed(homed),
            AxisName::Y => self.axes[1].set_homed(homed),
            AxisName::Z => self.axes[2].set_homed(homed),
        }
    }
}

impl<S: Scalar, const N: usize> Stage<S, N> {
    /// The stage in pieces.
    #[inline(always)]
    pub fn as_ref(&self) -> StageRef<'_, S, N> {
        StageRef {
            axes: self.axes.each_ref(),
            streaming: self.streaming,
        }
    }

    /// The axes themselves, and what belongs to the stage beside them.
    pub fn into_axes(self) -> ([Axis<S, N>; 3], StreamLoss) {
        (self.axes, self.streaming)
    }

    /// One axis, to be put in the place of another in a [`StageRef`].
    pub fn axis(&self, axis: AxisName) -> &Axis<S, N> {
        let [x, y, z] = &self.axes;
        match axis {
            AxisName::X => x,
            AxisName::Y => y,
            AxisName::Z => z,
        }
    }

    /// One control period; see [`StageRef::tick`].
    #[inline(always)]
    pub fn tick(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        self.as_ref().tick(plan, state, inputs)
    }
}

impl<S: Scalar, const N: usize> StageRef<'_, S, N> {
    /// One control period.
    ///
    /// A fault found in this tick switches the outputs off in this tick, or begins a stop under control, as its
    /// [`Reaction`] says. No path panics, allocates, or loops without a bound; every operation saturates.
    #[inline(always)]
    pub fn tick(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        let tick = state.tick;
        state.tick = tick.wrapping_add(1);
        let driven = state.safety.drives();
        let mut good = inputs.switches.are_good();
        for ((axis, memory), reading) in self
            .axes
            .into_iter()
            .zip(&mut state.axes)
            .zip(&inputs.readings)
        {
            good &= axis.measure(memory, reading);
        }
        state.obstacle = None;
        if !good {
            self.object(state, inputs.switches, tick);
        }
        if inputs.deadline_missed && driven {
            self.trip(state, FaultCode::DeadlineMissed, None, tick);
        }
        if inputs.link_lost && state.is_running() {
            self.trip(state, FaultCode::LinkLost, None, tick);
        }
        if state.safety == SafetyState::Start && state.obstacle.is_none() {
            state.safety = SafetyState::Disabled;
        }
        if let Some(command) = inputs.command {
            self.obey(state, command, driven, tick);
        }
        if state.injection.is_running() {
            self.inject(state, tick);
        }
        if state.safety.drives() {
            self.refer(plan, state, inputs.switches, tick);
        }
        if !state.safety.drives() {
            state.injection.end();
            for (axis, memory) in self.axes.into_iter().zip(&mut state.axes) {
                axis.rest(memory);
            }
            return Outputs::default();
        }
        let mut outputs = Outputs {
            codes: [DacCode::ZERO; 3],
            enabled: true,
        };
        for (((axis, memory), code), changed) in self
            .axes
            .into_iter()
            .zip(&mut state.axes)
            .zip(&mut outputs.codes)
            .zip(inputs.settings_changed)
        {
            *code = axis.drive(memory, changed);
        }
        outputs
    }

    /// Advances the references of driven axes.
    #[inline(always)]
    fn refer(&self, plan: &Plan<S>, state: &mut StageState<S, N>, switches: Switches, tick: u32) {
        let mut good = true;
        for (((axis, memory), motion), name) in self
            .axes
            .into_iter()
            .zip(&mut state.axes)
            .zip(plan)
            .zip(AxisName::ALL)
        {
            good &= axis.refer(memory, motion, switches.axis(name), tick);
        }
        if !good {
            self.trip_suspects(state, tick);
        }
        if let SafetyState::Stopping(fault) = state.safety {
            settle(state, fault);
        }
    }

    /// Says which input is bad, and makes a fault of it if the outputs are driven.
    #[cold]
    #[inline(never)]
    fn object(&self, state: &mut StageState<S, N>, switches: Switches, tick: u32) {
        state.obstacle = switches.obstacle();
        for (memory, name) in state.axes.iter().zip(AxisName::ALL) {
            if let Some(code) = memory.suspect
                && matches!(code, FaultCode::StaleSample | FaultCode::EncoderInvalid)
                && state.obstacle.is_none()
            {
                state.obstacle = Some(Obstacle {
                    code,
                    axis: Some(name),
                });
            }
        }
        if let Some(Obstacle { code, axis }) = switches.obstacle() {
            self.trip(state, code, axis, tick);
        }
        self.trip_suspects(state, tick);
    }

    /// Makes a fault of what the axes are under suspicion of. One that switches off goes before one that stops.
    #[cold]
    #[inline(never)]
    fn trip_suspects(&self, state: &mut StageState<S, N>, tick: u32) {
        let [x, y, z] = &mut state.axes;
        let suspects = [x.suspect.take(), y.suspect.take(), z.suspect.take()];
        for first in [Reaction::Off, Reaction::Stop, Reaction::Hold] {
            for (code, name) in suspects.into_iter().zip(AxisName::ALL) {
                if let Some(code) = code
                    && self.streaming.reaction(code) == first
                {
                    self.trip(state, code, Some(name), tick);
                }
            }
        }
    }

    /// Reacts to a fault, if the outputs are driven.
    #[cold]
    #[inline(never)]
    fn trip(
        &self,
        state: &mut StageState<S, N>,
        code: FaultCode,
        axis: Option<AxisName>,
        tick: u32,
    ) {
        if !state.safety.drives() {
            return;
        }
        let fault = Fault { code, axis, tick };
        let reaction = self.streaming.reaction(code);
        let was_enabled = state.safety.is_enabled();
        state.safety.trip(fault, reaction);
        if !was_enabled || reaction == Reaction::Off {
            return;
        }
        state.settled = 0;
        if reaction == Reaction::Hold && state.held.is_none() {
            state.held = Some(fault);
        }
        self.end_injection(state);
        for (axis, memory) in self.axes.into_iter().zip(&mut state.axes) {
            axis.stop(memory);
        }
    }

    /// Acts on a command. `driven`: the outputs were when the tick began.
    #[cold]
    #[inline(never)]
    fn obey(&self, state: &mut StageState<S, N>, command: Command, driven: bool, tick: u32) {
        // A reset is for a fault that was there to be seen, not for one of this tick.
        if driven && command == Command::ResetFault {
            return;
        }
        if state.safety.apply(command, state.obstacle.is_some()) {
            state.held = None;
            for (axis, memory) in self.axes.into_iter().zip(&mut state.axes) {
                axis.enable(memory);
            }
        } else if state.safety.is_enabled() {
            self.start(state, command, tick);
        }
    }

    /// Starts or ends motions of an enabled stage.
    fn start(&self, state: &mut StageState<S, N>, command: Command, tick: u32) {
        let free = !state.is_injecting();
        let starts = match command {
            Command::Run => !state.is_running(),
            Command::StartStream => free && state.axes.iter().all(AxisState::is_stream_ready),
            Command::StartInjection => state.is_injection_ready() && !state.is_running(),
            Command::Home(_) | Command::Jog(..) | Command::StartMove(_) => free,
            Command::Stop => true,
            Command::Enable | Command::Disable | Command::ResetFault => false,
        };
        if !starts {
            return;
        }
        match command {
            Command::Stop => self.end_injection(state),
            _ => state.held = None,
        }
        if command == Command::StartInjection {
            self.start_injection(state, tick);
            return;
        }
        for ((axis, memory), name) in self
            .axes
            .into_iter()
            .zip(&mut state.axes)
            .zip(AxisName::ALL)
        {
            if command.axis().is_none_or(|only| only == name) {
                axis.obey(memory, command);
            }
        }
    }
}

/// Latches the fault of a stop once the axes stand.
#[cold]
#[inline(never)]
fn settle<S: Scalar, const N: usize>(state: &mut StageState<S, N>, fault: Fault) {
    if state.is_running() {
        return;
    }
    state.settled = state.settled.saturating_add(1);
    if state.settled > SETTLING_TICKS {
        state.safety = SafetyState::Faulted(fault);
    }
}
