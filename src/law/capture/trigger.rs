//! Triggers of a capture.

use serde::{Deserialize, Serialize};

use crate::law::rounding;
use crate::law::scalar::Scalar;
use crate::law::telemetry::{Channel, Observation, WordKind};

/// Sense in which a level is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// From below the level to it or above.
    Rising,
    /// From above the level to it or below.
    Falling,
    /// Rising or falling, whichever comes.
    Either,
}

/// A level of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// The channel, whether it is recorded or not.
    pub channel: Channel,
    /// Sense in which it is crossed.
    pub edge: Edge,
    /// The level, in the channel's unit: finite; rounded to `f32`, or to the integers of a channel of integers.
    pub level: f64,
}

/// The event that a capture waits for. A fault triggers it in any case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trigger {
    /// Nothing: the first tick.
    Now,
    /// The next command that reaches the control law.
    Command,
    /// The next fault of any kind.
    Fault,
    /// A channel that crosses a level.
    Level(Level),
    /// An axis that begins to move while none did.
    MotionStart,
}

/// The event that froze a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaptureCause {
    /// It was stopped by hand.
    Stopped,
    /// It waited for nothing.
    Now,
    /// A command reached the control law.
    Command,
    /// A fault was found.
    Fault,
    /// A level was crossed.
    Level,
    /// A motion began while none was under way.
    MotionStart,
}

/// A level as its channel's words have it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Threshold {
    Float(f32),
    Integer(i32),
}

impl Threshold {
    /// Compares a word: true if below, true if above.
    #[inline(always)]
    fn sides(self, word: u32) -> (bool, bool) {
        match self {
            Self::Float(level) => {
                let value = f32::from_bits(word);
                (value < level, value > level)
            }
            Self::Integer(level) => {
                let value = word as i32;
                (value < level, value > level)
            }
        }
    }
}

/// A trigger ready for the tick, with its memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    trigger: Trigger,
    threshold: Threshold,
    /// Nothing has been seen yet: there is no change to speak of.
    fresh: bool,
    running: bool,
    below: bool,
    above: bool,
}

impl Watch {
    pub(super) const fn new() -> Self {
        Self {
            trigger: Trigger::Now,
            threshold: Threshold::Integer(0),
            fresh: false,
            running: false,
            below: false,
            above: false,
        }
    }

    /// A watch that has seen nothing yet; none if its level is not a finite number.
    pub(super) fn arm(trigger: Trigger) -> Option<Self> {
        let threshold = match trigger {
            Trigger::Level(Level { level, .. }) if !level.is_finite() => {
                return None;
            }
            Trigger::Level(Level { channel, level, .. }) => match channel.word_kind() {
                WordKind::Float => Threshold::Float(level as f32),
                WordKind::Integer => Threshold::Integer(rounding::round(level) as i32),
            },
            _ => Threshold::Integer(0),
        };
        Some(Self {
            trigger,
            threshold,
            fresh: true,
            ..Self::new()
        })
    }

    /// Looks at a tick; gives the cause if it triggers.
    #[inline(always)]
    pub(super) fn step<S: Scalar, const N: usize>(
        &mut self,
        seen: &Observation<'_, S, N>,
    ) -> Option<CaptureCause> {
        let fresh = core::mem::replace(&mut self.fresh, false);
        // A fault that is older than this tick is not news, and one of the first tick seen is.
        let found = [seen.stage.safety().fault(), seen.stage.held()];
        if found
            .into_iter()
            .flatten()
            .any(|fault| fault.tick == seen.tick())
        {
            return Some(CaptureCause::Fault);
        }
        match self.trigger {
            Trigger::Now => Some(CaptureCause::Now),
            Trigger::Fault => None,
            Trigger::Command => seen.commanded.then_some(CaptureCause::Command),
            Trigger::MotionStart => {
                let running = seen.stage.is_running();
                let was_running = core::mem::replace(&mut self.running, running);
                (running && !was_running && !fresh).then_some(CaptureCause::MotionStart)
            }
            Trigger::Level(Level { channel, edge, .. }) => {
                let (below, above) = self.threshold.sides(channel.read(seen));
                let was_below = core::mem::replace(&mut self.below, below);
                let was_above = core::mem::replace(&mut self.above, above);
                let rising = was_below && !below;
                let falling = was_above && !above;
                let crossed = match edge {
                    Edge::Rising => rising,
                    Edge::Falling => falling,
                    Edge::Either => rising || falling,
                };
                (crossed && !fresh).then_some(CaptureCause::Level)
            }
        }
    }
}
