//! Settings as bytes that a later or an earlier firmware can read: every value under its path.
//!
//! ```text
//! set    = format (1), provenance, records
//! record = shared, suffix, kind, axes, a value for each axis in `axes`
//! ```
//!
//! A record's path is as much of the last record's as `shared` says, and `suffix`; `*` stands for the axis, so that the
//! path is written once for all three. `axes` has a bit for each axis that has the leaf. Records come in the order of the
//! fields; first come those of the parts that may be left out (kind 0), which have no values. Texts and values have
//! their length before them. All of it is postcard (<https://postcard.jamesmunns.com/wire-format>); values are too, and
//! a name is stored as its text. A leaf that changes its type or its meaning gets a new name, and so does a list whose
//! points change.

use serde::{Deserialize, Serialize};

/// The format that is written, and the only one there has been.
pub const FORMAT: u8 = 1;

/// The head of a set.
#[derive(Serialize, Deserialize)]
pub(super) struct Head<'a> {
    pub(super) format: u8,
    pub(super) provenance: &'a str,
}

/// The head of a record; `axes` is its last byte.
#[derive(Serialize, Deserialize)]
pub(super) struct RecordHead<'a> {
    pub(super) shared: u8,
    pub(super) suffix: &'a str,
    pub(super) kind: u8,
    pub(super) axes: u8,
}
