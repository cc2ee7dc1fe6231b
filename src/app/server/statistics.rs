//! Statistics of the server, for the board's own log.

use super::Server;
use crate::hal::SettingsFlash;
use quadrant_law::scalar::Scalar;

/// Statistics of a server: counts that only grow, and wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServerStatistics {
    /// True if a host has said hello.
    pub greeted: bool,
    /// The tick of the last request.
    pub request_tick: u32,
    /// Frames that were damaged, too long, or no message.
    pub bad_frames: u32,
    /// Samples of the present selection of telemetry that found no room.
    pub dropped_samples: u32,
    /// Notices that found no room.
    pub dropped_events: u32,
    /// Number of times that settings were applied.
    pub applied: u16,
    /// Number of times that settings were stored.
    pub stored: u16,
    /// Number of complete captures.
    pub captures: u16,
}

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    /// Returns the statistics.
    pub fn statistics(&self) -> ServerStatistics {
        let frames = self.link.counters();
        ServerStatistics {
            greeted: self.link.is_greeted(),
            request_tick: self.request_tick,
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
}
