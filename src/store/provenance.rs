//! The text that says where stored settings come from.

use heapless::String;

/// The longest text on where settings come from, in bytes.
pub const PROVENANCE_BYTES: usize = 200;

/// Origin of settings: the command, its version, the record.
pub type Provenance = String<PROVENANCE_BYTES>;
