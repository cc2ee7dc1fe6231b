//! Three axes, one tick: a pure function of settings, memory and inputs.

use crate::axis::{Axis, AxisState};
use crate::friction::gms::FIRMWARE_ELEMENTS;
use crate::reference::Motion;
use crate::safety::{AxisName, Command, Fault, FaultCode, SafetyState};
use crate::scalar::Scalar;
use crate::units::DacCode;

/// The motions that the axes run together.
pub type Plan<S> = [Motion<S>; 3];

/// What one tick reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// The encoders' raw counters.
    pub counts: [u32; 3],
    /// A command to act on, once.
    pub command: Option<Command>,
    /// The settings were exchanged since the last tick.
    pub settings_changed: bool,
    /// The last tick ended after its deadline.
    pub deadline_missed: bool,
}

/// What one tick writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The converters' words; zero unless enabled.
    pub codes: [DacCode; 3],
    /// Whether the amplifiers are enabled.
    pub enabled: bool,
}

/// The stage ready for the tick; `N` is the room for GMS elements. Made by
/// [`StageSettings::build`](crate::settings::StageSettings::build).
#[derive(Clone, Debug, PartialEq)]
pub struct Stage<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    pub(crate) axes: [Axis<S, N>; 3],
}

/// The memory of the stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageState<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    axes: [AxisState<S, N>; 3],
    safety: SafetyState,
    tick: u32,
}

impl<S: Scalar, const N: usize> Default for StageState<S, N> {
    fn default() -> Self {
        Self {
            axes: core::array::from_fn(|_| AxisState::default()),
            safety: SafetyState::default(),
            tick: 0,
        }
    }
}

impl<S: Scalar, const N: usize> StageState<S, N> {
    /// The axes' memories.
    pub fn axes(&self) -> &[AxisState<S, N>; 3] {
        &self.axes
    }

    /// Who drives the outputs.
    pub fn safety(&self) -> SafetyState {
        self.safety
    }

    /// Control ticks so far; wraps after five days at 10 kHz.
    pub fn tick(&self) -> u32 {
        self.tick
    }

    /// Whether any motion is under way.
    pub fn is_running(&self) -> bool {
        self.axes.iter().any(AxisState::is_running)
    }

    #[cold]
    #[inline(never)]
    fn trip(&mut self, code: FaultCode, axis: Option<AxisName>, tick: u32) {
        self.safety.trip(Fault { code, axis, tick });
    }

    /// Latches the fault of the first axis that is under suspicion.
    #[inline(always)]
    fn trip_suspects(&mut self, tick: u32) {
        for (index, name) in AxisName::ALL.into_iter().enumerate() {
            if let Some(code) = self.axes[index].suspect {
                self.trip(code, Some(name), tick);
            }
        }
    }
}

impl<S: Scalar, const N: usize> Stage<S, N> {
    /// One control period.
    ///
    /// A fault found in this tick switches the outputs off in this tick. No path panics, allocates, or loops without
    /// a bound; every operation saturates.
    #[inline(always)]
    pub fn tick(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        let tick = state.tick;
        state.tick = tick.wrapping_add(1);
        let was_enabled = state.safety.is_enabled();
        for (axis, (memory, count)) in self
            .axes
            .iter()
            .zip(state.axes.iter_mut().zip(inputs.counts))
        {
            let plausible = axis.measure(memory, count);
            memory.suspect = (was_enabled && !plausible).then_some(FaultCode::EncoderJump);
        }
        state.trip_suspects(tick);
        if inputs.deadline_missed && was_enabled {
            state.trip(FaultCode::DeadlineMissed, None, tick);
        }
        if let Some(command) = inputs.command {
            self.obey(state, command, was_enabled);
        }
        if state.safety.is_enabled() {
            for (axis, (memory, motion)) in self.axes.iter().zip(state.axes.iter_mut().zip(plan)) {
                let follows = axis.refer(memory, motion, tick);
                memory.suspect = (!follows).then_some(FaultCode::FollowingError);
            }
            state.trip_suspects(tick);
        }
        if !state.safety.is_enabled() {
            for (axis, memory) in self.axes.iter().zip(&mut state.axes) {
                axis.rest(memory);
            }
            return Outputs::default();
        }
        let mut outputs = Outputs {
            codes: [DacCode::ZERO; 3],
            enabled: true,
        };
        for ((axis, memory), code) in self
            .axes
            .iter()
            .zip(&mut state.axes)
            .zip(&mut outputs.codes)
        {
            *code = axis.drive(memory, inputs.settings_changed);
        }
        outputs
    }

    /// Acts on a command.
    #[cold]
    #[inline(never)]
    fn obey(&self, state: &mut StageState<S, N>, command: Command, was_enabled: bool) {
        // A reset is for a fault that was there to be seen, not for one of this tick.
        if was_enabled && command == Command::ResetFault {
            return;
        }
        let moving = state.is_running();
        if state.safety.apply(command) {
            for (axis, memory) in self.axes.iter().zip(&mut state.axes) {
                axis.enable(memory);
            }
        } else if command == Command::Run && state.safety.is_enabled() && !moving {
            for (axis, memory) in self.axes.iter().zip(&mut state.axes) {
                axis.run(memory);
            }
        }
    }
}
