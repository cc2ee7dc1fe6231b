//! A session with a machine.

use quadrant_host::client::Client;
use quadrant_host::client::settings::Before;
use quadrant_host::log::LogDecoder;
use quadrant_law::safety::Switches;

use super::printer::Printer;

/// A session with a machine, and the printer of its results.
pub(super) struct Session {
    pub(super) client: Client,
    pub(super) printer: Printer,
    /// Inputs that `press` holds.
    pub(super) pressed: Switches,
    /// Settings that were in force before each `apply` and `load`, the newest last.
    pub(super) undo: Vec<Before>,
    /// The origin of the settings that act, as far as this session knows it.
    pub(super) origin: Origin,
    /// Decoder of the board's log, once an image was given.
    pub(super) log: Option<LogDecoder>,
}

/// The origin of the settings that act.
#[derive(Clone, Debug, Default)]
pub(super) struct Origin {
    /// The file that was loaded last, and what wrote it.
    pub(super) loaded: Option<String>,
    /// Settings were edited since.
    pub(super) edited: bool,
}

impl Session {
    pub(super) fn new(client: Client, printer: Printer) -> Self {
        Self {
            client,
            printer,
            pressed: Switches::NONE,
            undo: Vec::new(),
            origin: Origin::default(),
            log: None,
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
