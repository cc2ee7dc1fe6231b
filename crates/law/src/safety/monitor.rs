//! The monitors of each axis, one small pure step a tick each, without a division.

use crate::hint::cold_path;

use crate::rounding;
use crate::scalar::{Quantity, Scalar};

/// Way in one sense that is motion under a high output, counts: a dead line dithers by one, and a cable that floats shows
/// some that come and go.
const MOTION_COUNTS: u32 = 64;
/// Fraction bits of a filtered speed.
pub(super) const SPEED_FRACTION_BITS: u32 = 8;
/// The speed is filtered over 2^3 ticks: at one count a tick, a single reading says little.
pub(super) const SPEED_FILTER_BITS: u32 = 3;
/// No axis moves further in a tick than 2^16 counts; an encoder that does so is faulty, and its filter shall not wrap.
const STEP_BITS: u32 = 16;
/// Addition of quantisation and noise to a filtered speed, counts per tick.
const SPEED_NOISE_COUNTS: f64 = 0.5;

/// Watches the measured speed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overspeed {
    limit: u32,
}

/// The memory of the filtered speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OverspeedState {
    /// In 2^-8 counts per tick.
    filtered: i32,
}

impl OverspeedState {
    /// The filtered speed, 2^-8 counts per tick, towards larger positions.
    pub fn speed(&self) -> i32 {
        self.filtered
    }
}

/// A limit of the filtered speed, 2^-8 counts per tick, with half a count for the quantisation. Settings time only.
pub(crate) fn speed_limit(counts_per_tick: f64) -> u32 {
    let limit = (counts_per_tick + SPEED_NOISE_COUNTS) * f64::from(1 << SPEED_FRACTION_BITS);
    rounding::round(limit) as u32
}

/// Above every filtered speed, and half of what is compared.
const LARGEST_LIMIT: u32 = i32::MAX as u32;

impl Overspeed {
    /// A limit that no speed exceeds.
    pub const UNLIMITED: Self = Self {
        limit: LARGEST_LIMIT,
    };

    /// A limit in counts per tick, at most 2^16; half a count is added for the quantisation. Settings time only.
    pub fn new(counts_per_tick: f64) -> Self {
        Self {
            limit: speed_limit(counts_per_tick).min(LARGEST_LIMIT),
        }
    }

    /// True if the filtered speed is within the limit.
    pub(crate) fn allows(&self, state: &OverspeedState) -> bool {
        // Between both ends, by one comparison.
        (state.filtered as u32).wrapping_add(self.limit) <= self.limit.wrapping_mul(2)
    }
}

impl OverspeedState {
    /// Takes a step of the encoder, counts.
    #[inline(always)]
    pub(crate) fn filter(&mut self, counts: i32) {
        let mut counts = counts;
        if counts.wrapping_add(1 << STEP_BITS) as u32 >> (STEP_BITS + 1) != 0 {
            cold_path();
            counts = counts.signum() << STEP_BITS;
        }
        let speed = counts << SPEED_FRACTION_BITS;
        self.filtered += (speed - self.filtered) >> SPEED_FILTER_BITS;
    }
}

/// Watches for an encoder that shows no motion while the output is high: less than 64 counts from where it stood. An encoder
/// of which a line is dead, or whose cable floats, shows counts that come and go.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalLoss<S> {
    level: S,
    ticks: u32,
}

/// The time for which the output has been high, and the distance since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SignalLossState {
    ticks: u32,
    travelled: i32,
}

impl<S: Scalar> SignalLoss<S> {
    /// Finds an axis that does not move within `ticks` while its output is at `level_v` (V) or above. Settings time only.
    pub fn new(level_v: f64, ticks: u32) -> Self {
        Self {
            level: S::quantise(level_v, Quantity::Voltage),
            ticks,
        }
    }

    /// A monitor that finds nothing.
    pub fn off() -> Self {
        Self {
            level: S::ZERO,
            ticks: u32::MAX,
        }
    }

    /// Takes a step of the encoder, counts, and the output that was in force before it, V; returns true if all is well.
    #[inline(always)]
    pub fn step(&self, state: &mut SignalLossState, counts: i32, output: S) -> bool {
        if output.magnitude() >= self.level {
            self.watch(state, counts)
        } else {
            state.ticks = 0;
            true
        }
    }

    #[inline(never)]
    fn watch(&self, state: &mut SignalLossState, counts: i32) -> bool {
        let before = if state.ticks == 0 { 0 } else { state.travelled };
        state.travelled = before.saturating_add(counts);
        if state.travelled.unsigned_abs() >= MOTION_COUNTS {
            state.ticks = 0;
        } else {
            state.ticks = state.ticks.saturating_add(1);
        }
        state.ticks <= self.ticks
    }
}

/// Watches the counts between index pulses: an encoder that loses edges comes to the next pulse with others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexSpacing {
    /// Counts between neighbouring pulses; zero: there is no index, or its spacing is not known.
    counts: u32,
    /// 2^32 over the counts, rounded down.
    reciprocal: u32,
    tolerance: u32,
}

/// The low 32 bits of the count at the last index pulse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IndexState {
    last: Option<u32>,
}

impl IndexState {
    /// True if a pulse was seen.
    pub(crate) const fn is_seen(&self) -> bool {
        self.last.is_some()
    }
}

impl IndexSpacing {
    /// Pulses `counts` apart (2 or more), each of which may be off by `tolerance` counts: a pulse has a width, and is
    /// met from both sides. None: there is no index, or its spacing is not known. Settings time only.
    pub fn new(counts: Option<u32>, tolerance: u32) -> Self {
        let counts = counts.unwrap_or(0);
        Self {
            counts,
            reciprocal: (1u64 << 32).checked_div(counts.into()).unwrap_or(0) as u32,
            tolerance,
        }
    }

    /// Remainder of a distance after whole spacings, counts.
    #[inline(always)]
    const fn beyond(&self, distance: u32) -> u32 {
        // The quotient from the rounded reciprocal is the true one or one less.
        let quotient = ((distance as u64 * self.reciprocal as u64) >> 32) as u32;
        let rest = distance.wrapping_sub(quotient.wrapping_mul(self.counts));
        if rest >= self.counts {
            rest - self.counts
        } else {
            rest
        }
    }

    /// Takes the count at an index pulse, its low 32 bits; returns true if it fits the last one.
    #[inline(always)]
    pub fn step(&self, state: &mut IndexState, count: u32) -> bool {
        let last = state.last.replace(count);
        let Some(last) = last else {
            return true;
        };
        let distance = (count.wrapping_sub(last) as i32).unsigned_abs();
        let beyond = self.beyond(distance);
        self.counts == 0
            || beyond <= self.tolerance
            || self.counts.wrapping_sub(beyond) <= self.tolerance
    }

    /// Forgets the last pulse: the counts that follow do not belong to the same count.
    pub(crate) fn forget(state: &mut IndexState) {
        state.last = None;
    }
}

/// Watches the tracking error against a limit that grows with the speed of the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Following<S: Scalar> {
    at_rest: S,
    per_speed: S::Gain,
    largest: S,
}

/// The largest error so far, and the limit that it was compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FollowingState<S> {
    error: S,
    limit: S,
}

impl<S: Scalar> FollowingState<S> {
    /// The largest error so far as a share of the limit at its time; above 1 after a following error, 0 before the
    /// first tick. For telemetry, not for the law: it divides.
    pub fn high_mark(&self) -> f32 {
        if self.limit > S::ZERO {
            self.error.to_f32(Quantity::Length) / self.limit.to_f32(Quantity::Length)
        } else {
            0.0
        }
    }
}

impl<S: Scalar> Following<S> {
    /// A limit of `at_rest_mm` that grows by `lag_s` times the speed of the reference, up to `largest_mm`. Settings time
    /// only.
    pub fn new(at_rest_mm: f64, lag_s: f64, largest_mm: f64) -> Self {
        Self {
            at_rest: S::quantise(at_rest_mm, Quantity::Length),
            per_speed: S::gain(lag_s, Quantity::Velocity, Quantity::Length),
            largest: S::quantise(largest_mm, Quantity::Length),
        }
    }

    /// The largest limit that the number type holds.
    pub fn unlimited() -> Self {
        Self::new(f64::MAX, 0.0, f64::MAX)
    }

    /// A memory without an error.
    #[inline(always)]
    pub fn start(&self) -> FollowingState<S> {
        FollowingState {
            error: S::ZERO,
            limit: self.largest,
        }
    }

    /// Takes the error (mm) and the reference's speed (mm/s, not negative); returns true if the axis follows.
    #[inline(always)]
    pub fn step(&self, state: &mut FollowingState<S>, error: S, speed: S) -> bool {
        let grown = self.at_rest + speed.scale(self.per_speed);
        let limit = if grown < self.largest {
            grown
        } else {
            self.largest
        };
        let error = error.magnitude();
        // error / limit against the mark, without dividing. As fractions, because in fixed point the product of two
        // lengths up to the largest limit, 20 mm, then fits.
        let crosswise = |a: S, b: S| a.times(b, Quantity::Fraction);
        if crosswise(error, state.limit) > crosswise(state.error, limit) {
            *state = FollowingState { error, limit };
        }
        error <= limit
    }
}
