//! What the board's own log tells of the server.

use embedded_storage::nor_flash::NorFlash;

use super::Server;
use crate::law::scalar::Scalar;
use crate::link::message::Provenance;

/// How a server is, in numbers that only grow, and wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Vitals {
    /// Whether a host has said hello.
    pub greeted: bool,
    /// The tick of the last request.
    pub heard_tick: u32,
    /// Frames that were damaged, too long, or no message.
    pub bad_frames: u32,
    /// Samples of the present selection of telemetry that found no room.
    pub dropped_samples: u32,
    /// Notices that found no room.
    pub dropped_events: u32,
    /// How often other settings came into force.
    pub applied: u16,
    /// How often settings were stored.
    pub stored: u16,
    /// Captures that are complete.
    pub captures: u16,
}

impl<S: Scalar, F: NorFlash> Server<'_, '_, S, F> {
    /// How the server is.
    pub fn vitals(&self) -> Vitals {
        let frames = self.port.counters();
        Vitals {
            greeted: self.port.is_greeted(),
            heard_tick: self.heard_tick,
            bad_frames: frames
                .damaged
                .wrapping_add(frames.overlong)
                .wrapping_add(frames.undecodable),
            dropped_samples: self.packer.dropped(),
            dropped_events: self.dropped_events,
            applied: self.applied,
            stored: self.stored,
            captures: self.recorder.number(),
        }
    }

    /// Where the settings in force, or the stored ones, come from.
    pub const fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// How many paths the draft of the settings has. Visits them all: for rare occasions.
    pub fn paths(&self) -> usize {
        let mut paths = 0;
        // An error of the tree would end the visit early, and show as a number that is too small.
        let _ = self.draft.settings().list("", &mut |_| paths += 1);
        paths
    }
}
