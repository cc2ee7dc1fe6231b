//! Motion from set points that a host sends: position, velocity and acceleration at equal times.
//!
//! The slow half (`StreamPlanner` of the settings) makes a [`Segment`] of each two set points; the tick only
//! adds. A segment is the one polynomial of fifth degree that meets both set points with velocity and acceleration,
//! written as forward differences, so position, velocity and acceleration are continuous over the whole stream and
//! every set point is met to the unit.

use super::sample::{MotionScale, ReferenceSample};
use crate::scalar::{Quantity, Scalar};
use crate::units::{POSITION_UNITS_PER_COUNT, Position};

/// Bits dropped from a difference before it becomes a velocity.
const VELOCITY_SHIFT: u32 = 56;
/// Bits dropped from a difference before it becomes an acceleration.
const ACCELERATION_SHIFT: u32 = 48;

/// The way of one axis from one set point to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Segment {
    /// Position at the start of the segment.
    pub start: Position,
    /// The forward differences of the position at the start, first to fifth.
    pub differences: [i128; 5],
    /// Ticks left of it; at least one when the axis receives it.
    pub ticks: u32,
    /// It begins a stream.
    pub first: bool,
    /// It ends a stream, at rest.
    pub last: bool,
}

impl Segment {
    /// Fraction bits of the differences beyond those of a [`Position`].
    pub const FRACTION_BITS: u32 = 64;

    /// Position at the start of the segment.
    pub const fn start(&self) -> Position {
        self.start
    }

    /// Duration of the segment in ticks.
    pub const fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Takes the place of an older one. Number by number, as a whole would be copied by a loop of five instructions a word.
    #[inline(always)]
    const fn replace(&mut self, other: &Self) {
        let [first, second, third, fourth, fifth] = &mut self.differences;
        self.start = other.start;
        [*first, *second, *third, *fourth, *fifth] = other.differences;
        self.ticks = other.ticks;
        self.first = other.first;
        self.last = other.last;
    }

    /// Advances the differences by a tick; the displacement since the segment's start goes into `position`.
    #[inline(always)]
    pub fn advance(&mut self, position: &mut i128) {
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

/// The segment under way and the one after it. Neither moves: when the one under way has run out, they change roles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamState {
    /// No ticks: it has run out, or none was put there.
    slots: [Segment; 2],
    /// The second slot holds the segment under way.
    turned: bool,
    /// A stream is under way, or its first segments are there.
    begun: bool,
    /// Displacement since the segment's start.
    displacement: i128,
}

impl StreamState {
    /// The segment under way and the one after it.
    const fn segments(&self) -> (&Segment, &Segment) {
        match (&self.slots, self.turned) {
            ([current, next], false) | ([next, current], true) => (current, next),
        }
    }

    /// True if there is room for a segment.
    pub const fn wants_segment(&self) -> bool {
        self.segments().1.ticks == 0
    }

    /// Takes a segment from the queue; call it when [`StreamState::wants_segment`]. What is left of a stream that was
    /// broken off is dropped: then only the first segment of another one is taken. One that comes before the end of the
    /// stream ends it: it begins elsewhere, so both are dropped from there on.
    pub fn offer(&mut self, segment: &Segment) {
        if self.begun == segment.first {
            self.begun = false;
            return;
        }
        self.begun = true;
        let [first, second] = &mut self.slots;
        let next = if self.turned { first } else { second };
        next.replace(segment);
    }

    /// True if a stream can start from a reference at rest at `position`.
    pub fn is_ready(&self, position: Position) -> bool {
        let (current, next) = self.segments();
        current.ticks == 0 && next.ticks > 0 && next.first && next.start == position
    }

    /// True if the segment that waits leaves its start.
    pub fn moves_first(&self) -> bool {
        let next = self.segments().1;
        // One by one: whole arrays would be compared by `memcmp`, which is not bounded here.
        next.ticks > 0 && next.differences.iter().any(|difference| *difference != 0)
    }

    /// Breaks the stream off and forgets what is left of it.
    pub fn clear(&mut self) {
        let [first, second] = &mut self.slots;
        first.ticks = 0;
        second.ticks = 0;
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
            let value = libm::scalbn(
                unit_mm * per_tick,
                shift as i32 - Segment::FRACTION_BITS as i32,
            );
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
        if state.segments().0.ticks == 0 {
            state.turned = !state.turned;
            state.displacement = 0;
        }
        let [first, second] = &mut state.slots;
        let segment = if state.turned { second } else { first };
        if segment.ticks == 0 {
            return StreamStep::Underrun;
        }
        let [before, second, ..] = segment.differences;
        segment.advance(&mut state.displacement);
        let [after, ..] = segment.differences;
        let rounded = state
            .displacement
            .wrapping_add(1 << (Segment::FRACTION_BITS - 1))
            >> Segment::FRACTION_BITS;
        // The differences around this tick's position: centred, so free of half a tick's lag.
        let velocity = before.wrapping_add(after) >> VELOCITY_SHIFT;
        let sample = ReferenceSample {
            position: segment.start + Position(rounded as i64),
            velocity: S::scale_wide(velocity as i64, self.velocity),
            acceleration: S::scale_wide((second >> ACCELERATION_SHIFT) as i64, self.acceleration),
        };
        segment.ticks -= 1;
        if segment.ticks == 0 && segment.last {
            state.clear();
            return StreamStep::Finished(ReferenceSample {
                position: sample.position,
                ..ReferenceSample::default()
            });
        }
        StreamStep::Moving(sample)
    }
}
