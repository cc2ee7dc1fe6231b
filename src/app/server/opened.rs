//! Streams and injections that a host has opened.

use quadrant_law::injection::InjectionProgress;
use quadrant_settings::stream_planner::StreamPlanner;

/// A stream that a host has opened.
#[derive(Debug)]
pub(super) struct OpenStream {
    pub(super) planner: StreamPlanner,
    /// The host's number of the set point that is expected next.
    pub(super) next: u32,
    /// The axes have received the order to start.
    pub(super) started: bool,
    /// The last set point has come.
    pub(super) complete: bool,
}

/// An injection that a host has opened.
#[derive(Debug)]
pub(super) struct OpenInjection {
    /// The largest magnitude of a value.
    pub(super) most: u16,
    /// The host's number of the value that is expected next.
    pub(super) next: u32,
    /// The last value has come.
    pub(super) complete: bool,
    /// The tick at which the control law was ordered to begin.
    pub(super) started: Option<u32>,
    pub(super) progress: Option<InjectionProgress>,
    pub(super) ended: bool,
}
