//! Three axes, one tick: a pure function of settings, memory and inputs.

use crate::axis::{Axis, AxisState};
use crate::feedforward::ReferenceStep;
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
pub struct Stage<S: Scalar, const N: usize = 4> {
    pub(crate) axes: [Axis<S, N>; 3],
}

/// The memory of the stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageState<S: Scalar, const N: usize = 4> {
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
        let [x, y, z] = &mut state.axes;
        let mut axes = [
            (AxisName::X, &self.axes[0], &plan[0], x, inputs.counts[0]),
            (AxisName::Y, &self.axes[1], &plan[1], y, inputs.counts[1]),
            (AxisName::Z, &self.axes[2], &plan[2], z, inputs.counts[2]),
        ];
        for (name, axis, _, memory, count) in &mut axes {
            if !axis.measure(memory, *count) && was_enabled {
                state.safety.trip(Fault {
                    code: FaultCode::EncoderJump,
                    axis: Some(*name),
                    tick,
                });
            }
        }
        if inputs.deadline_missed && was_enabled {
            state.safety.trip(Fault {
                code: FaultCode::DeadlineMissed,
                axis: None,
                tick,
            });
        }
        // A reset is for a fault that was there to be seen, not for one of this tick.
        let early_reset = was_enabled && inputs.command == Some(Command::ResetFault);
        if let Some(command) = inputs.command
            && !early_reset
        {
            let moving = axes.iter().any(|(_, _, _, memory, _)| memory.is_running());
            if state.safety.apply(command) {
                for (_, axis, _, memory, _) in &mut axes {
                    axis.enable(memory);
                }
            } else if command == Command::Run && state.safety.is_enabled() && !moving {
                for (_, axis, _, memory, _) in &mut axes {
                    axis.run(memory);
                }
            }
        }
        let mut references = [ReferenceStep {
            displacement: S::ZERO,
            velocity: S::ZERO,
            acceleration: S::ZERO,
        }; 3];
        if state.safety.is_enabled() {
            for ((name, axis, motion, memory, _), reference) in axes.iter_mut().zip(&mut references)
            {
                let (step, follows) = axis.refer(memory, motion, tick);
                *reference = step;
                if !follows {
                    state.safety.trip(Fault {
                        code: FaultCode::FollowingError,
                        axis: Some(*name),
                        tick,
                    });
                }
            }
        }
        if !state.safety.is_enabled() {
            for (_, axis, _, memory, _) in &mut axes {
                axis.rest(memory);
            }
            return Outputs::default();
        }
        let mut outputs = Outputs {
            codes: [DacCode::ZERO; 3],
            enabled: true,
        };
        for (((_, axis, _, memory, _), reference), code) in
            axes.iter_mut().zip(references).zip(&mut outputs.codes)
        {
            *code = axis.drive(memory, reference, inputs.settings_changed);
        }
        outputs
    }
}
