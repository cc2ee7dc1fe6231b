//! The change detector: events of the slow half for the log, found by comparing the machine with its last state.
//!
//! Changes of the safety state, refusals and faults are found by the [`supervisor`](quadrant_law::supervisor).

use heapless::Vec;

use super::{ServerStatistics, TimingStatistics};
use quadrant_law::admission::StageView;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::motion::MotionMode;

/// Ticks without a word from a host after which it counts as silent: 3 s at 10 kHz.
const SILENT_TICKS: u32 = 30_000;

/// Most changes of one comparison: two of each axis, one of each other kind.
pub const MAX_STATE_CHANGES: usize = 14;

/// A change since the last comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateChange {
    /// An axis entered a motion mode.
    Began(AxisName, MotionMode),
    /// An axis left a motion mode.
    Ended(AxisName, MotionMode),
    /// An axis was homed.
    Homed(AxisName),
    /// Homing ended without a home position.
    NotHomed(AxisName),
    /// A host said hello for the first time.
    Greeted,
    /// A host that said hello has been silent for three seconds.
    Silent,
    /// A silent host sent a request again.
    Back,
    /// Other settings are in force on all axes that they concern.
    Applied,
    /// Settings were stored.
    Stored,
    /// The capture of this number is complete.
    Captured(u16),
    /// This number of frames were damaged, too long, or no message.
    BadFrames(u32),
    /// This number of telemetry samples were dropped.
    SamplesLost(u32),
    /// This number of notices to the host were dropped.
    EventsLost(u32),
    /// This number of control ticks began or ended late.
    LateTicks(u32),
}

/// The state of the machine at the last comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChangeDetector {
    modes: PerAxis<MotionMode>,
    server: ServerStatistics,
    overruns: u32,
    is_silent: bool,
}

impl ChangeDetector {
    /// Compares the machine at a tick with its last state; returns the changes.
    pub fn compare(
        &mut self,
        tick: u32,
        view: &StageView,
        server: ServerStatistics,
        timing: TimingStatistics,
    ) -> Vec<StateChange, MAX_STATE_CHANGES> {
        let mut changes = Vec::new();
        // There is room for all there can be.
        let mut report = |change| {
            let _ = changes.push(change);
        };
        for ((axis, homed), (was, is)) in AxisName::ALL
            .into_iter()
            .zip(view.homed)
            .zip(self.modes.into_iter().zip(view.modes))
        {
            if was == is {
                continue;
            }
            match was {
                MotionMode::Hold => {}
                MotionMode::Home if homed => report(StateChange::Homed(axis)),
                MotionMode::Home => report(StateChange::NotHomed(axis)),
                other => report(StateChange::Ended(axis, other)),
            }
            if is != MotionMode::Hold {
                report(StateChange::Began(axis, is));
            }
        }
        self.modes = view.modes;

        let silent = server.greeted && tick.wrapping_sub(server.request_tick) > SILENT_TICKS;
        if server.greeted && !self.server.greeted {
            report(StateChange::Greeted);
        } else if silent != self.is_silent {
            report(if silent {
                StateChange::Silent
            } else {
                StateChange::Back
            });
        }
        self.is_silent = silent;
        if server.applied != self.server.applied {
            report(StateChange::Applied);
        }
        if server.stored != self.server.stored {
            report(StateChange::Stored);
        }
        if server.captures != self.server.captures {
            report(StateChange::Captured(server.captures));
        }
        let ServerStatistics {
            bad_frames,
            dropped_samples,
            dropped_events,
            ..
        } = self.server;
        // A count that is smaller began again, with another selection of telemetry.
        if server.bad_frames > bad_frames {
            report(StateChange::BadFrames(server.bad_frames - bad_frames));
        }
        if server.dropped_samples > dropped_samples {
            report(StateChange::SamplesLost(
                server.dropped_samples - dropped_samples,
            ));
        }
        if server.dropped_events > dropped_events {
            report(StateChange::EventsLost(
                server.dropped_events - dropped_events,
            ));
        }
        if timing.overruns > self.overruns {
            report(StateChange::LateTicks(timing.overruns - self.overruns));
        }
        self.server = server;
        self.overruns = timing.overruns;
        changes
    }
}
