//! The trigger of a capture, stepped in the control interrupt.

use quadrant_link::message::{CaptureCause, Edge, Level, Trigger, WordKind};

use crate::app::telemetry::{Observation, read};
use quadrant_law::rounding;
use quadrant_law::scalar::Scalar;

/// A level as its channel's words have it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Threshold {
    Float(f32),
    Integer(i32),
}

impl Threshold {
    /// Returns whether a word lies below, and whether above.
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

    /// Returns the cause if the capture triggers at this tick.
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
                let (below, above) = self.threshold.sides(read(channel, seen));
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
