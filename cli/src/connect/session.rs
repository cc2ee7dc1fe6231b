//! A session with a machine.

use quadrant::safety::Switches;
use quadrant_sim::client::Client;

use super::printer::Printer;

/// A session with a machine, and the printer of its results.
pub(super) struct Session {
    pub(super) client: Client,
    pub(super) printer: Printer,
    /// Inputs that `press` holds.
    pub(super) pressed: Switches,
}

impl Session {
    pub(super) const fn new(client: Client, printer: Printer) -> Self {
        Self {
            client,
            printer,
            pressed: Switches::NONE,
        }
    }

    /// Returns the machine's name and firmware, in a line.
    pub(super) fn greeting(&self) -> String {
        let identity = self.client.identity();
        format!(
            "{}: {} with firmware {}",
            self.client.endpoint(),
            identity.board,
            identity.firmware
        )
    }
}
