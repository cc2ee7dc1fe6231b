//! Identity and status of the machine.

use super::Server;
use crate::app::wire::{Translated, learning_state};
use crate::hal::SettingsFlash;
use quadrant_law::admission;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::{SafetyState, Station};
use quadrant_law::scalar::{Quantity, Scalar};
use quadrant_law::units::{POSITION_FRACTION_BITS, Position};
use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::message::{
    AxisLearning, AxisSet, AxisStatus, FaultReport, Identity, Inputs, Learning, MachineState,
    Status, text,
};

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    pub(super) fn identity(&self) -> Identity {
        Identity {
            protocol: PROTOCOL_VERSION,
            firmware: text(format_args!("{}", env!("CARGO_PKG_VERSION"))),
            board: text(format_args!("{}", self.board)),
            rate_hz: self.draft.in_force().rate_hz,
            cycle_hz: self.cycle_hz,
            number: self.number,
            tick: self.seen.tick,
        }
    }

    pub(super) fn status(&self) -> Status {
        let view = &self.seen.view;
        let settings = self.draft.in_force();
        let axes = core::array::from_fn(|index| {
            let (axis, settings) = (&self.seen.axes[index], &settings.axes[index]);
            let measured = Position(axis.measured.0 << POSITION_FRACTION_BITS);
            AxisStatus {
                mode: Translated::translated(view.modes[index]),
                position_mm: measured.to_mm(settings.encoder.resolution_mm),
                error_mm: axis.error.to_f32(Quantity::Length),
                output_v: axis.output.to_f32(Quantity::Voltage),
                limited_by: Translated::translated(axis.limited_by),
                high_mark: axis.following.high_mark(),
            }
        });
        Status {
            tick: self.seen.tick,
            state: self.state(),
            fault: view.safety.fault().map(|fault| fault.code.number()),
            running: view.running,
            homed: set_of(view.homed),
            axes,
            overruns: self.timing.overruns,
            longest_tick_cycles: self.timing.longest_tick_cycles,
            capture: self.recorder.phase(),
            frames: self.frames,
            dropped_samples: self.packer.dropped(),
            dropped_events: self.dropped_events,
        }
    }

    pub(super) fn inputs(&self) -> Inputs {
        let view = self.seen.view;
        let refusal = admission::refusal_from(Station::Host, view, Command::Enable);
        Inputs {
            tick: self.seen.tick,
            switches: self.seen.switches.bits(),
            indexed: set_of(self.seen.indexed),
            refusal: refusal.map(|refusal| match refusal.axis() {
                Some(axis) => text(format_args!("{axis}: {}", refusal.as_str())),
                None => text(format_args!("{}", refusal.as_str())),
            }),
        }
    }

    pub(super) fn learning(&self) -> Learning {
        Learning {
            tick: self.seen.tick,
            axes: self.seen.axes.map(|axis| {
                let seen = axis.learning;
                Some(AxisLearning {
                    state: learning_state(seen.status)?,
                    scale: seen.scale(),
                    gate: seen.gate(),
                    error_share: seen.error_share(),
                })
            }),
        }
    }

    /// The machine's state: as the safety has it, but homing counts as one.
    fn state(&self) -> MachineState {
        let view = &self.seen.view;
        let homing = view.modes.into_iter().any(|mode| mode == MotionMode::Home);
        match MachineState::translated(view.safety) {
            MachineState::Enabled if homing => MachineState::Homing,
            state => state,
        }
    }

    /// The latched fault, or the one for which the axes brake.
    pub(super) fn fault(&self) -> Option<FaultReport> {
        let fault = match self.seen.view.safety {
            SafetyState::Faulted(fault) | SafetyState::Stopping(fault) => fault,
            _ => return None,
        };
        Some(FaultReport {
            code: fault.code.number(),
            axis: fault.axis.map(Translated::translated),
            tick: fault.tick,
            name: text(format_args!("{}", fault.code.name())),
            cause: text(format_args!("{}", fault.code.cause())),
            remedy: text(format_args!("{}", fault.code.remedy())),
            captured: self.recorder.holds_trace_of(fault.tick),
        })
    }
}

/// The axes for which it is true.
fn set_of(axes: PerAxis<bool>) -> AxisSet {
    let named = AxisName::ALL.into_iter().zip(axes);
    named
        .filter_map(|(axis, is_true)| is_true.then_some(Translated::translated(axis)))
        .collect()
}
