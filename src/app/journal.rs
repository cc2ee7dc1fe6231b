//! What there is to tell a person of the slow half: found by comparing what is with what was.
//!
//! Changes of the safety state, refusals and faults are the [`supervisor`](crate::app::supervisor)'s to find; here is the rest.

use heapless::Vec;

use super::{Meters, Vitals};
use crate::law::admission::StageView;
use crate::law::axes::{AxisName, PerAxis};
use crate::law::motion::MotionMode;

/// Ticks without a word from a host after which it counts as silent: 3 s at 10 kHz.
const SILENT_TICKS: u32 = 30_000;

/// Most that one look can find: two for each axis, one of each other kind.
pub const MOST_NEWS: usize = 14;

/// Something that has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// An axis began to follow something.
    Began(AxisName, MotionMode),
    /// It no longer does.
    Ended(AxisName, MotionMode),
    /// An axis found its home position.
    Homed(AxisName),
    /// Homing ended, and the axis does not know where it is.
    NotHomed(AxisName),
    /// A host said hello for the first time.
    Greeted,
    /// A host that said hello has been silent for three seconds.
    Silent,
    /// It speaks again.
    Back,
    /// Other settings are in force on all axes that they concern.
    Applied,
    /// Settings were stored.
    Stored,
    /// A capture is complete: its number.
    Captured(u16),
    /// So many frames were damaged, too long, or no message.
    BadFrames(u32),
    /// So many samples of the telemetry found no room.
    SamplesLost(u32),
    /// So many notices to the host found no room.
    EventsLost(u32),
    /// So many control ticks ended late.
    LateTicks(u32),
}

/// What was seen last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Journal {
    modes: PerAxis<MotionMode>,
    vitals: Vitals,
    overruns: u32,
    is_silent: bool,
}

impl Journal {
    /// Compares the machine at a tick with what it was at the last look.
    pub fn look(
        &mut self,
        tick: u32,
        view: &StageView,
        vitals: Vitals,
        meters: Meters,
    ) -> Vec<News, MOST_NEWS> {
        let mut news = Vec::new();
        // There is room for all there can be.
        let mut tell = |item| {
            let _ = news.push(item);
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
                MotionMode::Home if homed => tell(News::Homed(axis)),
                MotionMode::Home => tell(News::NotHomed(axis)),
                other => tell(News::Ended(axis, other)),
            }
            if is != MotionMode::Hold {
                tell(News::Began(axis, is));
            }
        }
        self.modes = view.modes;

        let silent = vitals.greeted && tick.wrapping_sub(vitals.heard_tick) > SILENT_TICKS;
        if vitals.greeted && !self.vitals.greeted {
            tell(News::Greeted);
        } else if silent != self.is_silent {
            tell(if silent { News::Silent } else { News::Back });
        }
        self.is_silent = silent;
        if vitals.applied != self.vitals.applied {
            tell(News::Applied);
        }
        if vitals.stored != self.vitals.stored {
            tell(News::Stored);
        }
        if vitals.captures != self.vitals.captures {
            tell(News::Captured(vitals.captures));
        }
        let Vitals {
            bad_frames,
            dropped_samples,
            dropped_events,
            ..
        } = self.vitals;
        // A count that is smaller began anew, with another selection of telemetry.
        if vitals.bad_frames > bad_frames {
            tell(News::BadFrames(vitals.bad_frames - bad_frames));
        }
        if vitals.dropped_samples > dropped_samples {
            tell(News::SamplesLost(vitals.dropped_samples - dropped_samples));
        }
        if vitals.dropped_events > dropped_events {
            tell(News::EventsLost(vitals.dropped_events - dropped_events));
        }
        if meters.overruns > self.overruns {
            tell(News::LateTicks(meters.overruns - self.overruns));
        }
        self.vitals = vitals;
        self.overruns = meters.overruns;
        news
    }
}
