//! A button that is a dead man's switch.

use quadrant_law::command::Command;

/// Ticks for which a button must read the same before it counts, 3.2 ms at 10 kHz: contacts bounce.
pub const DEBOUNCE_TICKS: u32 = u32::BITS;

/// Enables while it is held.
///
/// A button that is down since the start has not been pressed: it must have been up before. Otherwise a button that is
/// stuck, or held over a restart, would enable a machine that nobody has asked to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HoldButton {
    /// Its states in the last ticks, the newest in the lowest bit.
    history: u32,
    was_up: bool,
    is_held: bool,
}

impl HoldButton {
    /// A button that nobody has looked at.
    pub const fn new() -> Self {
        Self {
            history: u32::MAX,
            was_up: false,
            is_held: false,
        }
    }

    /// Returns this tick's request: to enable once the button has been down for [`DEBOUNCE_TICKS`], and to disable at
    /// the first tick it is up.
    #[inline(always)]
    pub const fn step(&mut self, is_down: bool) -> Option<Command> {
        self.history = self.history << 1 | is_down as u32;
        if self.history == 0 {
            self.was_up = true;
        }
        if self.is_held && !is_down {
            self.is_held = false;
            Some(Command::Disable)
        } else if !self.is_held && self.was_up && self.history == u32::MAX {
            self.is_held = true;
            self.was_up = false;
            Some(Command::Enable)
        } else {
            None
        }
    }
}

impl Default for HoldButton {
    fn default() -> Self {
        Self::new()
    }
}
