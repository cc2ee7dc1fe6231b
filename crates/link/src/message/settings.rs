//! Requests about settings, by path.

use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

use super::axis::AxisSet;

/// Largest encoded value, bytes.
pub const MAX_VALUE_BYTES: usize = 320;

/// Paths in a [`PathPage`] at most.
pub const PAGE_PATHS: usize = 4;

/// The path of a setting, such as `/axes/0/encoder/resolution_mm`: up to 96 bytes.
pub type Path = String<96>;

/// The value of a setting in postcard (`docs/settings-storage.md`). A host turns it into text and back with settings of its
/// own: JSON would take more of the firmware's flash than the rest of its settings.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Value {
    /// The type of the value: a number, a name, a list.
    pub kind: u8,
    /// The encoded value.
    pub bytes: Vec<u8, MAX_VALUE_BYTES>,
}

/// The origin of settings, as text: up to 200 bytes.
pub type Provenance = String<200>;

/// A request about the settings. Changes are made to a draft, which [`SettingsRequest::Apply`] checks as a whole.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum SettingsRequest {
    /// Asks for the value at a path of the draft: a [`Value`].
    Get(Path),
    /// Changes a value of the draft.
    Set {
        /// The path of the value.
        path: Path,
        /// The new value.
        value: Value,
    },
    /// Asks for the paths from a cursor on: a [`PathPage`].
    List {
        /// Zero, or [`PathPage::next`].
        cursor: u16,
    },
    /// Checks the draft and puts it in force, or refuses it as a whole: [`Applied`].
    Apply,
    /// Replaces the draft by the settings in force.
    Revert,
    /// Replaces the draft by the defaults.
    Defaults,
    /// Stores the draft for the next start: the settings in force, unless it was edited since.
    Store(Provenance),
    /// Asks for the origin of the stored settings: a [`Provenance`].
    Provenance,
    /// Asks for the paths at which the draft differs from the settings in force, from a cursor on: a [`PathPage`].
    Edited {
        /// Zero, or [`PathPage::next`].
        cursor: u16,
    },
    /// Asks for the value at a path of the settings in force: a [`Value`].
    GetInForce(Path),
}

/// A page of the list of paths.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathPage {
    /// The paths, in the order of the tree.
    pub paths: Vec<Path, PAGE_PATHS>,
    /// The cursor of the next page, if there is one.
    pub next: Option<u16>,
}

/// The effect of applying the draft.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Applied {
    /// The axes that have new settings.
    pub changed: AxisSet,
    /// True if a change takes effect only after a store and a restart.
    pub restart_needed: bool,
}
