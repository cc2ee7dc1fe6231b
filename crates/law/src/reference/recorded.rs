//! Motion along a recorded table of positions, as a drawing, a part program or another machine's record gives it.

use super::motion_state::MotionState;
use super::sample::{MotionScale, ReferenceSample};
use crate::scalar::{Quantity, Scalar};
use crate::units::{POSITION_UNITS_PER_COUNT, Position};

/// A table of positions at equal times, interpolated by Catmull-Rom cubics: position and velocity are continuous.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTable<S: Scalar> {
    samples: &'static [Position],
    ticks_per_sample: u32,
    place_per_tick: i64,
    velocity: S::Gain,
    acceleration: S::Gain,
}

/// Fraction bits of the place between two samples.
const PLACE_BITS: u32 = 24;

impl<S: Scalar> RecordedTable<S> {
    /// A table of at least one sample, `ticks_per_sample` (at least one) control periods apart. The table stays where
    /// it is: in flash on a target, for the life of the process on a host.
    pub fn new(samples: &'static [Position], ticks_per_sample: u32, scale: MotionScale) -> Self {
        let ticks_per_sample = ticks_per_sample.max(1);
        let unit_mm = scale.resolution_mm / POSITION_UNITS_PER_COUNT;
        let rate = scale.rate_hz / f64::from(ticks_per_sample);
        // The polynomial carries twice the position: Catmull-Rom's factor of a half is taken here.
        let velocity = 0.5 * unit_mm * rate;
        Self {
            samples,
            ticks_per_sample,
            place_per_tick: (1 << (PLACE_BITS + 16)) / i64::from(ticks_per_sample),
            velocity: S::gain(velocity, Quantity::Integer, Quantity::Velocity),
            acceleration: S::gain(velocity * rate, Quantity::Integer, Quantity::Acceleration),
        }
    }

    /// Sample `index` after the first, from it; the ends are held.
    #[inline(always)]
    fn at(&self, index: i64) -> i64 {
        let (Some(first), Some(last)) = (self.samples.first(), self.samples.last()) else {
            return 0;
        };
        let sample = if index < 0 {
            first
        } else {
            self.samples.get(index as usize).unwrap_or(last)
        };
        (*sample - *first).0
    }

    // Not inlined: its wide integers would crowd the registers of the motions that run for hours.
    #[inline(never)]
    pub(super) fn step(&self, state: &mut MotionState) -> ReferenceSample<S> {
        // The phase holds the present sample in its upper half and the tick within it in the lower.
        let (index, tick) = ((state.phase >> 32) as i64, state.phase as u32);
        state.phase = if tick + 1 >= self.ticks_per_sample {
            ((index as u64) + 1) << 32
        } else {
            state.phase + 1
        };
        let place = (i64::from(tick) * self.place_per_tick) >> 16;
        let here = self.at(index);
        let before = self.at(index - 1) - here;
        let next = self.at(index + 1) - here;
        let after = self.at(index + 2) - here;
        let linear = next - before;
        let square = 2 * before + 4 * next - after;
        let cube = after - 3 * next - before;
        let weigh = |value: i64| (value.saturating_mul(place)) >> PLACE_BITS;
        let doubled = weigh(linear + weigh(square + weigh(cube)));
        let slope = linear + weigh(2 * square + weigh(3 * cube));
        let bend = 2 * square + weigh(6 * cube);
        ReferenceSample {
            position: Position(here + (doubled >> 1)),
            velocity: S::scale_wide(slope, self.velocity),
            acceleration: S::scale_wide(bend, self.acceleration),
        }
    }

    pub(super) fn finished(&self, state: &MotionState) -> bool {
        // The last sample has been put out.
        state.phase > (self.samples.len().saturating_sub(1) as u64) << 32
    }
}
