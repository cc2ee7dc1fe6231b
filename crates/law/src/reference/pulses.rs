//! A reference of counted pulses: step and direction from another control.
//!
//! The count is a staircase, and the feedforward needs the motion behind it. Two moving averages of the same length, one behind the
//! other, weigh the steps of the last ticks by a triangle:
//!
//! ```text
//!   velocity[k] = sum of w[j] u[k - j],  w[j] = min(j + 1, 2n - 1 - j) / n²,  j = 0 to 2n - 2
//! ```
//!
//! with `u` the steps of a tick and `n` the length in ticks. Position is the sum of the velocity, delayed by `n - 1` ticks. No weight is
//! negative: steps in one sense never make a velocity in the other, so friction's sense of motion turns when the pulses turn, and only
//! then. A fit of a parabola and an observer turn it more often at the same delay; `quadrant-studies step-direction` compares them.
//!
//! A mean over a curved path lies on its inner side: with a delay `D`, a circle of radius `R` at a feed `v` becomes smaller by
//! `v² D² / 12 R`. The acceleration `a` is known from the same averages, so the feedback's reference is put back by
//! `a D (D + 2T) / 12`, `T` being the control period. It lags the feedforward's by the axis' preview, and the correction is a mean over
//! twice that, so that no step makes it jump. What two steps explain is not corrected: up to a sixth of a step is left. The
//! feedforward's reference is left as it is.
//!
//! Sums are of integers: there is no drift, and an axis comes to rest where the sum of the pulses says.

use super::sample::{MotionScale, ReferenceSample};
use crate::axis::MAX_PREVIEW_TICKS;
use crate::hint::cold_path;
use crate::rounding;
use crate::safety::FaultCode;
use crate::scalar::{Quantity, Scalar};
use crate::units::{POSITION_UNITS_PER_COUNT, Position};

/// Longest delay of the moving averages, ticks: 24 ms at 10 kHz.
pub const MAX_PULSE_DELAY_TICKS: u32 = 239;
/// Room for the steps of past ticks; a power of two.
const ROOM: usize = 512;
/// Longest wait beside the delay, ticks: what is left of the room.
pub const MAX_PULSE_WAIT_TICKS: u32 = ROOM as u32 - 1 - 2 * (MAX_PULSE_DELAY_TICKS + 1);
/// Room for past velocities: twice the longest preview, and more; a power of two.
const SUMS_ROOM: usize = 64;
const _: () = assert!(2 * MAX_PREVIEW_TICKS + 1 < SUMS_ROOM);
/// Steps by which the two averages differ on a slow reversal, only because the count is a staircase.
const UNCERTAIN_STEPS: u32 = 2;
/// Fraction bits of the correction's factor.
const CORRECTION_BITS: u32 = 16;
/// Most steps of a tick: the sums fit 32 bits.
const MOST_STEPS: f64 = 30_000.0;
/// Fraction bits of the position below its unit.
const FRACTION_BITS: u32 = 32;
/// Largest acceleration over the axis' own that pulses may have.
const ACCELERATION_RATIO: f64 = 4.0;
/// Steps that rounding may add to a count of them.
const ROUNDING_STEPS: f64 = 3.0;

/// Scale and limits of a pulse train.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseScale {
    /// Length of a step, mm; negative where a count upwards moves the axis to smaller positions.
    pub step_mm: f64,
    /// Width of the counter, bits, 1 to 32.
    pub counter_bits: u32,
    /// Delay of the moving averages, ticks, up to [`MAX_PULSE_DELAY_TICKS`].
    pub delay_ticks: u32,
    /// Delay besides, ticks, up to [`MAX_PULSE_WAIT_TICKS`]: that of an axis whose preview is shorter than another's.
    pub wait_ticks: u32,
    /// Preview of the axis, ticks.
    pub preview_ticks: u32,
    /// Largest velocity, mm/s.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration of the axis, mm/s²; pulses may have four times that.
    pub max_acceleration_mm_s2: f64,
}

/// The way from counted pulses to the reference, ready for the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseReference<S: Scalar> {
    /// Bits of a count that the counter does not have.
    unused_bits: u32,
    length: usize,
    wait: usize,
    /// Most steps of a tick.
    most_steps: u32,
    /// Most of the velocity's sum, and most by which it changes in a tick.
    most_velocity: u32,
    most_change: u32,
    /// Position units for the velocity's sum, 2^-32.
    units: i64,
    velocity: S::Gain,
    acceleration: S::Gain,
    /// Ticks over which the correction is averaged.
    averaged: usize,
    /// Change of the velocity's sum over them that the staircase has by itself.
    uncertain: u32,
    /// Position units for the velocity's change over them, 2^-16.
    correction: i64,
}

/// The reference of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowedPulses<S> {
    /// The reference after the preview.
    pub ahead: ReferenceSample<S>,
    /// Distance to the path from the feedback's reference, which is the former of the preview ago.
    pub correction: Position,
}

/// The memory of a pulse train.
#[derive(Clone, Debug, PartialEq)]
pub struct PulseState {
    count: u32,
    position: Position,
    /// Of the position, below its unit.
    fraction: u32,
    /// Steps of the newer and of the older moving average.
    newer: i32,
    older: i32,
    /// Their sum weighed by the triangle: the velocity in `1 / n²` steps per tick.
    sum: i32,
    steps: [i16; ROOM],
    sums: [i32; SUMS_ROOM],
    place: usize,
}

impl Default for PulseState {
    fn default() -> Self {
        Self::new()
    }
}

impl PulseState {
    /// A memory of no pulses, at the origin.
    pub const fn new() -> Self {
        Self {
            count: 0,
            position: Position::ZERO,
            fraction: 0,
            newer: 0,
            older: 0,
            sum: 0,
            steps: [0; ROOM],
            sums: [0; SUMS_ROOM],
            place: 0,
        }
    }

    /// Begins at rest: `count` is the counter's, `position` that of the reference.
    pub fn start(&mut self, count: u32, position: Position) {
        // Field by field: a whole memory, made apart and copied, takes half a tick longer.
        let Self {
            count: at,
            position: here,
            fraction,
            newer,
            older,
            sum,
            steps,
            sums,
            place,
        } = self;
        (*at, *here) = (count, position);
        (*fraction, *newer, *older, *sum, *place) = (0, 0, 0, 0, 0);
        steps.fill(0);
        sums.fill(0);
    }
}

impl<S: Scalar> PulseReference<S> {
    /// A reference of pulses of that scale. Settings time only.
    pub fn new(pulses: &PulseScale, scale: MotionScale) -> Self {
        let rate = scale.rate_hz;
        let length = pulses.delay_ticks.min(MAX_PULSE_DELAY_TICKS) + 1;
        let weight = f64::from(length) * f64::from(length);
        let step_mm = pulses.step_mm;
        let per_mm = 1.0 / step_mm.abs();
        let most = pulses.max_velocity_mm_s / rate * per_mm;
        let change = ACCELERATION_RATIO * pulses.max_acceleration_mm_s2 / (rate * rate) * per_mm;
        let units = step_mm / scale.resolution_mm * POSITION_UNITS_PER_COUNT / weight;
        let averaged = 2 * pulses.preview_ticks.min(MAX_PREVIEW_TICKS as u32) + 1;
        let correction = units * (weight - 1.0) / (-12.0 * f64::from(averaged));
        // `as` saturates.
        let whole = |value: f64| rounding::ceil(value) as u32;
        Self {
            unused_bits: 32 - pulses.counter_bits.clamp(1, 32),
            length: length as usize,
            wait: pulses.wait_ticks.min(MAX_PULSE_WAIT_TICKS) as usize,
            most_steps: whole((2.0 * most + ROUNDING_STEPS).min(MOST_STEPS)),
            most_velocity: whole(most * weight + ROUNDING_STEPS * f64::from(length)),
            // Jitter moves up to a tick's steps from one average to the other.
            most_change: whole(change * weight + most + ROUNDING_STEPS),
            units: rounding::round(libm::scalbn(units, FRACTION_BITS as i32)) as i64,
            velocity: S::gain(
                step_mm * rate / weight,
                Quantity::Integer,
                Quantity::Velocity,
            ),
            acceleration: S::gain(
                step_mm * rate * rate / weight,
                Quantity::Integer,
                Quantity::Acceleration,
            ),
            averaged: averaged as usize,
            uncertain: UNCERTAIN_STEPS * averaged,
            correction: rounding::round(libm::scalbn(correction, CORRECTION_BITS as i32)) as i64,
        }
    }

    /// The reference of the next tick, from the counter's count in it.
    ///
    /// # Errors
    /// [`FaultCode::PulseJump`]: more steps than twice the largest velocity has, or a speed that changes by more than four times the
    /// largest acceleration. [`FaultCode::PulseOverspeed`]: a mean speed above the largest. The memory is as before then.
    #[inline(never)]
    pub fn step(&self, state: &mut PulseState, count: u32) -> Result<FollowedPulses<S>, FaultCode> {
        let moved = count.wrapping_sub(state.count);
        let steps = ((moved << self.unused_bits) as i32) >> self.unused_bits;
        if steps.unsigned_abs() > self.most_steps {
            cold_path();
            return Err(FaultCode::PulseJump);
        }
        let place = (state.place + 1) % ROOM;
        let past = |ticks: usize| i32::from(state.steps[place.wrapping_sub(ticks) % ROOM]);
        let entering = if self.wait == 0 {
            steps
        } else {
            past(self.wait)
        };
        let passing = past(self.wait + self.length);
        let leaving = past(self.wait + 2 * self.length);
        let newer = state.newer.wrapping_add(entering - passing);
        let older = state.older.wrapping_add(passing - leaving);
        let change = newer.wrapping_sub(older);
        let sum = state.sum.wrapping_add(change);
        if change.unsigned_abs() > self.most_change {
            cold_path();
            return Err(FaultCode::PulseJump);
        }
        if sum.unsigned_abs() > self.most_velocity {
            cold_path();
            return Err(FaultCode::PulseOverspeed);
        }
        state.count = count;
        state.place = place;
        // Within the room of 16 bits: no more than `MOST_STEPS`.
        state.steps[place] = steps as i16;
        (state.newer, state.older, state.sum) = (newer, older, sum);
        let way = i64::from(sum)
            .wrapping_mul(self.units)
            .wrapping_add(i64::from(state.fraction));
        state.fraction = way as u32;
        state.position = state
            .position
            .saturating_add(Position(way >> FRACTION_BITS));
        let before = state.sums[place.wrapping_sub(self.averaged) % SUMS_ROOM];
        state.sums[place % SUMS_ROOM] = sum;
        let bend = sum.wrapping_sub(before);
        let beyond = bend.unsigned_abs().saturating_sub(self.uncertain);
        let known = i64::from(beyond) * i64::from(bend.signum());
        Ok(FollowedPulses {
            ahead: ReferenceSample {
                position: state.position,
                velocity: S::scale_integer(sum, self.velocity),
                acceleration: S::scale_integer(change, self.acceleration),
            },
            correction: Position(known.wrapping_mul(self.correction) >> CORRECTION_BITS),
        })
    }
}
