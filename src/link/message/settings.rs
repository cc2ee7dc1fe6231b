//! Settings by path.

use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

use super::motion::AxisSet;
use crate::settings::MAX_VALUE_BYTES;

/// Paths in a [`PathPage`] at most.
pub const PAGE_PATHS: usize = 4;

/// The path of a setting, such as `/axes/0/feedback/pid/kp_v_per_mm`: up to 96 bytes.
pub type Path = String<96>;

/// The value of a setting, as [`StageSettings::get_bytes`](crate::settings::StageSettings::get_bytes) gives it. A host turns
/// it into text and back with settings of its own: JSON would take more of the firmware than the rest of its settings.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Value {
    /// What the bytes are: a number, a name, a list (`docs/settings-storage.md`).
    pub kind: u8,
    /// The bytes.
    pub bytes: Vec<u8, MAX_VALUE_BYTES>,
}

/// Where settings came from: up to 200 bytes.
pub type Provenance = String<200>;

/// What is asked of the settings. Changes are made to a draft, which [`SettingsRequest::Apply`] checks as a whole.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum SettingsRequest {
    /// The value at a path of the draft: a `Value`.
    Get(Path),
    /// Change the draft.
    Set {
        /// Where.
        path: Path,
        /// To what.
        value: Value,
    },
    /// The paths from a cursor on: a `PathPage`.
    List {
        /// Zero, or [`PathPage::next`].
        cursor: u16,
    },
    /// Check the draft and act on it from the next tick: `Applied`.
    Apply,
    /// Replaces the draft by the settings in force.
    Revert,
    /// Make the draft the defaults.
    Defaults,
    /// Stores the draft for the next start.
    Store(Provenance),
    /// Where the kept settings came from: a `Provenance`.
    Provenance,
}

/// Some of the paths.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathPage {
    /// The paths.
    pub paths: Vec<Path, PAGE_PATHS>,
    /// The cursor of the next page, if there is one.
    pub next: Option<u16>,
}

/// What applying the draft changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Applied {
    /// The axes that have new settings.
    pub changed: AxisSet,
    /// Something was changed that acts only after a store and a restart.
    pub restart_needed: bool,
}
