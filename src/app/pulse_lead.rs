//! Axes that another control leads by step and direction.
//!
//! The control switches them on and off by its line SERVO ON, as it does with a drive. An axis whose settings have `pulses` follows the
//! steps from where it stands when it is enabled: what the control counted before does not matter. A host may move it while the line is
//! off, or before it begins to follow.

use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::axis::Commissioning;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{PulseState, ReferenceSample};
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_law::scalar::Scalar;

use super::{Control, Enabling};
use crate::drivers::hold_button::HoldButton;
use crate::hal::{PulseReadings, Pulses};

/// The control's hold on an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Hold {
    /// None: the axis stands, or a host moves it.
    #[default]
    Released,
    /// The axis follows the steps.
    Leads,
    /// It followed them until a fault or a host stopped it, and does not again before the line was off.
    Ended,
}

/// The lines of a control, and the axes that it leads.
#[derive(Debug)]
pub struct PulseLead<'a, P> {
    lines: P,
    /// The memories of the axes whose steps are counted.
    states: [Option<&'a mut PulseState>; 3],
    servo_on: HoldButton,
    /// The line is on, and counts.
    is_on: bool,
    enabling: Enabling,
    holds: PerAxis<Hold>,
}

impl<'a, P: Pulses> PulseLead<'a, P> {
    /// A control that leads nothing yet. `states` has a memory for each axis whose steps the board counts.
    pub fn new(lines: P, states: [Option<&'a mut PulseState>; 3]) -> Self {
        Self {
            lines,
            states,
            servo_on: HoldButton::new(),
            is_on: false,
            enabling: Enabling::default(),
            holds: PerAxis::splat(Hold::Released),
        }
    }

    /// Reads the lines and moves the references of the axes that follow, before a tick; returns the command that the lines bring about
    /// in it.
    #[inline(never)]
    pub fn step<S: Scalar>(&mut self, control: &mut Control<'_, '_, S>) -> Option<Command> {
        let stage = control.stage();
        let follows = PerAxis::from_fn(|name| {
            self.states[name as usize].is_some() && stage.axes[name].pulses().is_some()
        });
        if !follows.contains(&true) {
            self.forget();
            return None;
        }
        let seen = self.lines.read();
        for name in AxisName::ALL {
            if follows[name] {
                self.follow(control, name, &seen);
            } else {
                self.holds[name] = Hold::Released;
            }
        }
        let request = self.servo_on.step(seen.servo_on);
        let safety = control.state().safety();
        self.lines.set_alarm(self.is_alarmed(safety));
        match request {
            // Two cannot lead: what a host drives ends, and the control does not take over what it has not seen begin.
            Some(Command::Enable) if safety.drives() => {
                self.is_on = true;
                self.enabling.end();
                self.holds = PerAxis::splat(Hold::Ended);
                return Some(Command::Disable);
            }
            Some(Command::Enable) => {
                self.is_on = true;
                self.enabling.begin();
                self.holds = PerAxis::splat(Hold::Released);
            }
            Some(_) => {
                self.is_on = false;
                self.enabling.end();
                // As the control wants it: no alarm.
                for name in AxisName::ALL {
                    if self.holds[name] == Hold::Leads {
                        self.holds[name] = Hold::Released;
                        control.release(name);
                    }
                }
                return safety.drives().then_some(Command::Disable);
            }
            None => {}
        }
        if !self.is_on {
            return None;
        }
        let command = self.enabling.step(safety);
        if command.is_some() {
            return command;
        }
        if self.waits(safety) {
            // What a host enables later is not the control's.
            self.holds = PerAxis::splat(Hold::Ended);
        }
        if safety.is_enabled() {
            return self.take_hold(control, follows, &seen);
        }
        None
    }

    /// True if the control must not go on: a fault, outputs that could not be enabled, or an axis that no longer follows.
    fn is_alarmed(&self, safety: SafetyState) -> bool {
        safety.fault().is_some() || self.waits(safety) || self.holds.contains(&Hold::Ended)
    }

    /// True if the line is on, and the outputs did not come on, or are off again.
    fn waits(&self, safety: SafetyState) -> bool {
        self.is_on && !self.enabling.is_under_way() && !safety.drives()
    }

    /// Forgets a control: its line counts only once it has been off with a setting that needs it.
    fn forget(&mut self) {
        self.servo_on = HoldButton::new();
        self.is_on = false;
        self.enabling.end();
        self.holds = PerAxis::splat(Hold::Released);
    }

    /// Moves the reference of an axis that follows the steps.
    fn follow<S: Scalar>(
        &mut self,
        control: &mut Control<'_, '_, S>,
        name: AxisName,
        seen: &PulseReadings,
    ) {
        if self.holds[name] != Hold::Leads {
            return;
        }
        let index = name as usize;
        let state = control.state();
        let follows = state.axes()[name].mode() == MotionMode::Plan;
        if !(follows && state.safety().is_enabled()) {
            self.holds[name] = Hold::Ended;
            return control.release(name);
        }
        let pulses = control.stage().axes[name].pulses().copied();
        let (Some(pulses), Some(memory)) = (pulses, &mut self.states[index]) else {
            return;
        };
        let found = if seen.lost[index] {
            Err(FaultCode::PulseJump)
        } else {
            pulses.step(memory, seen.counts[index])
        };
        match found {
            Ok(followed) => {
                control.lead(name, None, followed.ahead);
                control.shift_reference(name, followed.correction);
            }
            Err(code) => {
                self.holds[name] = Hold::Ended;
                control.report_fault(name, code);
            }
        }
    }

    /// Lets the next axis that stands follow the steps.
    fn take_hold<S: Scalar>(
        &mut self,
        control: &mut Control<'_, '_, S>,
        follows: PerAxis<bool>,
        seen: &PulseReadings,
    ) -> Option<Command> {
        for name in AxisName::ALL {
            let axis = control.stage().axes[name];
            let state = &control.state().axes()[name];
            let command = Command::StartMove(name);
            if self.holds[name] != Hold::Released
                || !follows[name]
                || axis.commissioning() != Commissioning::Done
                || state.mode() != MotionMode::Hold
                || control.refusal(command).is_some()
            {
                continue;
            }
            let position = state.reference();
            self.holds[name] = Hold::Leads;
            if let Some(memory) = &mut self.states[name as usize] {
                memory.start(seen.counts[name as usize], position);
            }
            let standing = ReferenceSample {
                position,
                ..ReferenceSample::default()
            };
            control.lead(name, None, standing);
            return Some(command);
        }
        None
    }
}
