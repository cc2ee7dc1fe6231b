//! Requests that wait for control.

use quadrant_law::axes::PerAxis;
use quadrant_link::message::Provenance;

/// The work of a request that waits for control.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Work {
    /// Store the draft, with its origin, while the outputs are kept off.
    Store(Provenance),
    /// Restart, while the outputs are kept off.
    Restart,
    /// Say what became of the plan, and keep its lowest and highest positions, mm from its start, if control has taken it.
    Plan(PerAxis<(f64, f64)>),
}

/// A request that is answered when control has taken the order that it came to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Deferred {
    /// The request's number.
    pub(super) id: u16,
    pub(super) work: Work,
}
