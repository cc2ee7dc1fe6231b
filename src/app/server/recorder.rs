//! The capture's book-keeping on the server's side.

use crate::app::capture::Capture;
use crate::app::telemetry::Selection;
use quadrant_link::message::CapturePhase;

/// The capture's book-keeping on this side.
#[derive(Debug)]
pub(super) struct Recorder<'a> {
    /// The capture, unless the control interrupt holds it.
    pub(super) capture: Option<Capture<'a>>,
    /// The selection that it was armed with.
    pub(super) selection: Option<Selection>,
    /// Number of complete captures.
    pub(super) number: u16,
}

impl<'a> Recorder<'a> {
    pub(super) fn new(words: &'a mut [u32]) -> Self {
        Self {
            capture: Some(Capture::new(words)),
            selection: None,
            number: 0,
        }
    }

    pub(super) fn phase(&self) -> CapturePhase {
        self.capture
            .as_ref()
            .map_or(CapturePhase::Armed, Capture::phase)
    }

    /// Number of complete captures.
    pub(super) const fn number(&self) -> u16 {
        self.number
    }

    /// True if the frozen capture holds a tick.
    pub(super) fn holds_trace_of(&self, tick: u32) -> bool {
        let record = self.capture.as_ref().and_then(Capture::record);
        record.is_some_and(|record| {
            let decimation = self.selection.as_ref().map_or(1, Selection::decimation);
            let span = record.samples.saturating_mul(decimation.into());
            tick.wrapping_sub(record.first_tick) < span
        })
    }
}
