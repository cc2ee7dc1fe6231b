//! Enabling by another control: within some ticks, or not.

use quadrant_law::command::Command;
use quadrant_law::safety::SafetyState;

/// Ticks in which the outputs must have been enabled.
const TICKS: u32 = 50;

/// An attempt of another control, such as LinuxCNC or one that makes steps, to enable the outputs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Enabling {
    ticks_left: u32,
}

impl Enabling {
    /// Begins an attempt.
    pub const fn begin(&mut self) {
        self.ticks_left = TICKS;
    }

    /// Gives the attempt up, or takes it as done.
    pub const fn end(&mut self) {
        self.ticks_left = 0;
    }

    /// True while the outputs may yet be enabled.
    pub const fn is_under_way(&self) -> bool {
        self.ticks_left > 0
    }

    /// One tick; returns the command that it takes in it: a fault is reset, and the outputs are enabled.
    pub fn step(&mut self, safety: SafetyState) -> Option<Command> {
        self.ticks_left = self.ticks_left.checked_sub(1)?;
        match safety {
            SafetyState::Faulted(_) => Some(Command::ResetFault),
            SafetyState::Disabled => Some(Command::Enable),
            SafetyState::Enabled => {
                self.end();
                None
            }
            SafetyState::Start | SafetyState::Stopping(_) => None,
        }
    }
}
