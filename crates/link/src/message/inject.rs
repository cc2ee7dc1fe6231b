//! A voltage added to an axis' output.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::axis::AxisName;

/// Values that one request holds at most: 19 ms at 10 kHz, so that asking once in that time keeps up.
pub const INJECT_VALUES: usize = 192;

/// Values in the converter's words, 32767 for plus full scale; two bytes each, little-endian.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Voltages(Vec<u8, { 2 * INJECT_VALUES }>);

impl Voltages {
    /// The first [`INJECT_VALUES`] of `values`.
    pub fn new(values: impl Iterator<Item = i16>) -> Self {
        Self(
            values
                .take(INJECT_VALUES)
                .flat_map(i16::to_le_bytes)
                .collect(),
        )
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        self.0.len() / 2
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values, in order; a byte beyond the last whole one, which only a wrong sender makes, is left out.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = i16> + Clone + '_ {
        let (values, _) = self.0.as_chunks();
        values.iter().map(|&bytes| i16::from_le_bytes(bytes))
    }
}

/// A request about an injected voltage.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum InjectRequest {
    /// Begins as soon as enough values are there.
    Open {
        /// The axis that is driven.
        axis: AxisName,
        /// The values alone drive the amplifier.
        open_loop: bool,
        /// The plan's motions start with the first value; in closed loop only.
        with_plan: bool,
        /// The largest magnitude of a value, V; above zero, at most the axis' output limit.
        limit_v: f64,
        /// Allowed distance from the present position, either way, mm; above zero.
        travel_mm: f64,
        /// Allowed speed, mm/s; above zero, at most the axis' limit.
        max_velocity_mm_s: f64,
    },
    /// The next values, one a control tick; none only ask how far it has come.
    Values {
        /// The number of the first of them, from zero. Values that the server has already are passed over, so that a
        /// request may be repeated; if any is missing, nothing is taken.
        sequence: u32,
        /// The values, in order.
        values: Voltages,
        /// The injection ends with the last of these.
        last: bool,
    },
    /// Breaks the injection off.
    Close,
}

/// Progress of an injected voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InjectStatus {
    /// The number of the value that the server expects next.
    pub next_sequence: u32,
    /// Values that it has room for now.
    pub free: u16,
    /// The control tick of the first value, once it has begun.
    pub first_tick: Option<u32>,
    /// Values that were put out.
    pub done: u32,
    /// It is over: all values were put out, or it was broken off.
    pub ended: bool,
}
