//! Motion from set points that a host sends: position, velocity and acceleration at equal times.
//!
//! The slow half ([`StreamPlanner`](super::StreamPlanner)) makes a [`Segment`] of each two set points; the tick only
//! adds. A segment is the one polynomial of fifth degree that meets both set points with velocity and acceleration,
//! written as forward differences, so position, velocity and acceleration are continuous over the whole stream and
//! every set point is met to the unit.

use super::sample::{MotionScale, ReferenceSample};
use crate::law::scalar::{Quantity, Scalar};
use crate::law::units::{POSITION_UNITS_PER_COUNT, Position};

/// Fraction bits of the differences beyond those of a [`Position`].
pub(super) const FRACTION_BITS: u32 = 64;
/// Bits dropped from the differences before they become a velocity and an acceleration.
const VELOCITY_SHIFT: u32 = 56;
const ACCELERATION_SHIFT: u32 = 48;

/// The way of one axis from one set point to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Position at the start of the segment.
    pub(super) start: Position,
    /// The forward differences of the position at the start, first to fifth.
    pub(super) differences: [i128; 5],
    /// Duration in ticks; at least one.
    pub(super) ticks: u32,
    /// It begins a stream.
    pub(super) first: bool,
    /// It ends a stream, at rest.
    pub(super) last: bool,
}

impl Segment {
    /// Position at the start of the segment.
    pub const fn start(&self) -> Position {
        self.start
    }

    /// Duration of the segment in ticks.
    pub const fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Advances the differences by a tick; the displacement since the segment's start goes into `position`.
    #[inline(always)]
    pub(super) fn advance(&mut self, position: &mut i128) {
        let [first, second, third, fourth, fifth] = &mut self.differences;
        *position = position.wrapping_add(*first);
        *first = first.wrapping_add(*second);
        *second = second.wrapping_add(*third);
        *third = third.wrapping_add(*fourth);
        *fourth = fourth.wrapping_add(*fifth);
    }
}

/// Result of a tick of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamStep<S> {
    /// The reference of this tick.
    Moving(ReferenceSample<S>),
    /// The reference of the stream's last tick, at rest on the last set point.
    Finished(ReferenceSample<S>),
    /// The next segment is not there: the motion has to be braked from where it is.
    Underrun,
}

/// The segment under way and the one after it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamState {
    current: Option<Segment>,
    /// Ticks left of the segment under way.
    left: u32,
    /// Displacement since the segment's start.
    displacement: i128,
    next: Option<Segment>,
    /// A stream is under way, or its first segments are there.
    begun: bool,
}

impl StreamState {
    /// True if there is room for a segment.
    #[inline(always)]
    pub const fn wants_segment(&self) -> bool {
        self.next.is_none()
    }

    /// Takes a segment from the queue; call it when [`StreamState::wants_segment`]. What is left of a stream that was
    /// broken off is dropped: then only the first segment of another one is taken.
    pub fn offer(&mut self, segment: Segment) {
        if self.begun || segment.first {
            self.begun = true;
            self.next = Some(segment);
        }
    }

    /// True if a stream can start from a reference at rest at `position`.
    pub fn is_ready(&self, position: Position) -> bool {
        self.current.is_none()
            && self
                .next
                .as_ref()
                .is_some_and(|segment| segment.first && segment.start == position)
    }

    /// Breaks the stream off and forgets what is left of it.
    pub fn clear(&mut self) {
        // Field by field: a whole one, made apart, is copied with the room of both segments.
        self.current = None;
        self.left = 0;
        self.displacement = 0;
        self.next = None;
        self.begun = false;
    }
}

/// The gains of an axis' streams, ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stream<S: Scalar> {
    velocity: S::Gain,
    acceleration: S::Gain,
}

impl<S: Scalar> Stream<S> {
    /// The gains of an axis. Settings time only.
    pub fn new(scale: MotionScale) -> Self {
        let unit_mm = scale.resolution_mm / POSITION_UNITS_PER_COUNT;
        let gain = |shift: u32, per_tick: f64, to| {
            let value = libm::scalbn(unit_mm * per_tick, shift as i32 - FRACTION_BITS as i32);
            S::gain(value, Quantity::Integer, to)
        };
        Self {
            // Half: the sum of two ticks' displacements is what becomes the velocity.
            velocity: gain(VELOCITY_SHIFT, 0.5 * scale.rate_hz, Quantity::Velocity),
            acceleration: gain(
                ACCELERATION_SHIFT,
                scale.rate_hz * scale.rate_hz,
                Quantity::Acceleration,
            ),
        }
    }

    /// The reference of the next tick.
    // Not inlined: its wide integers would crowd the registers of the motions that run for hours.
    #[inline(never)]
    pub fn step(&self, state: &mut StreamState) -> StreamStep<S> {
        if state.left == 0 {
            let Some(next) = state.next.take() else {
                return StreamStep::Underrun;
            };
            state.left = next.ticks;
            state.displacement = 0;
            state.current = Some(next);
        }
        let Some(segment) = &mut state.current else {
            return StreamStep::Underrun;
        };
        let [before, second, ..] = segment.differences;
        segment.advance(&mut state.displacement);
        let [after, ..] = segment.differences;
        let rounded = state.displacement.wrapping_add(1 << (FRACTION_BITS - 1)) >> FRACTION_BITS;
        // The differences around this tick's position: centred, so free of half a tick's lag.
        let velocity = before.wrapping_add(after) >> VELOCITY_SHIFT;
        let sample = ReferenceSample {
            position: segment.start + Position(rounded as i64),
            velocity: S::scale_wide(velocity as i64, self.velocity),
            acceleration: S::scale_wide((second >> ACCELERATION_SHIFT) as i64, self.acceleration),
        };
        let ends = segment.last;
        state.left -= 1;
        if state.left == 0 && ends {
            state.clear();
            return StreamStep::Finished(ReferenceSample {
                position: sample.position,
                ..ReferenceSample::default()
            });
        }
        StreamStep::Moving(sample)
    }
}
