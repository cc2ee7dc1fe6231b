//! A velocity that is brought to a target within limits of acceleration and jerk: jogging, searching for a switch, and
//! stopping from any motion under way.
//!
//! Acceleration moves on a lattice, whole multiples of the jerk per tick. Bringing it from level `k` back to zero
//! then changes the velocity by exactly `T(k - 1)`, with `T(k) = J k (k + 1) / 2`, so that comparisons of integers
//! decide in each tick whether to raise, hold or lower it, and the velocity lands on its target exactly.

use core::ops::Neg;

use super::sample::{MotionScale, ReferenceSample};
use crate::rounding;
use crate::scalar::{Quantity, Scalar};
use crate::units::{POSITION_UNITS_PER_COUNT, Position};

/// Fraction bits of a [`Velocity`].
const FRACTION_BITS: u32 = 32;
/// Fraction bits that remain when a velocity becomes a number.
const VELOCITY_BITS: u32 = 8;
/// Fraction bits that remain when an acceleration becomes a number.
const ACCELERATION_BITS: u32 = 16;
/// Largest velocity: no difference of two, and no sum with what braking needs, overflows.
const MAX_VELOCITY: i64 = 1 << 61;

/// A displacement per tick in 2^-32 of a [`Position`] unit, so that no velocity that a machine can distinguish is rounded
/// away; at most +-2^29 units (8192 counts) in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Velocity(i64);

impl Velocity {
    /// No motion: zero velocity.
    pub const ZERO: Self = Self(0);

    /// The nearest velocity to `value_mm_s`, saturating; `NaN` gives rest. Settings time only.
    #[inline(never)]
    pub fn from_mm_s(value_mm_s: f64, scale: MotionScale) -> Self {
        Self::clamped(rounding::round(value_mm_s * steps_per_mm(scale) / scale.rate_hz) as i64)
    }

    /// The velocity of a displacement in one tick, saturating.
    pub const fn from_displacement(displacement: Position) -> Self {
        Self::clamped((displacement.clipped() as i64) << FRACTION_BITS)
    }

    /// The velocity in mm/s. For people and files, not for the tick.
    pub fn to_mm_s(self, scale: MotionScale) -> f64 {
        self.0 as f64 / steps_per_mm(scale) * scale.rate_hz
    }

    /// The velocity in its smallest steps, 2^-32 units per tick.
    pub const fn steps(self) -> i64 {
        self.0
    }

    /// The whole position units per tick of the speed, rounded up.
    const fn speed_units(self) -> u32 {
        (self.0.unsigned_abs() >> FRACTION_BITS) as u32 + 1
    }

    #[inline(always)]
    const fn clamped(value: i64) -> Self {
        if value > MAX_VELOCITY {
            Self(MAX_VELOCITY)
        } else if value < -MAX_VELOCITY {
            Self(-MAX_VELOCITY)
        } else {
            Self(value)
        }
    }
}

impl Neg for Velocity {
    type Output = Self;
    fn neg(self) -> Self {
        // Within +-2^61: nothing to wrap.
        Self(self.0.wrapping_neg())
    }
}

/// Steps of a [`Velocity`] that make one mm per tick.
pub fn steps_per_mm(scale: MotionScale) -> f64 {
    libm::scalbn(
        POSITION_UNITS_PER_COUNT / scale.resolution_mm,
        FRACTION_BITS as i32,
    )
}

/// The limits of a ramp, ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ramp<S: Scalar> {
    /// Change of the acceleration in a tick.
    jerk: i64,
    /// The largest acceleration, in multiples of the jerk.
    levels: i32,
    /// Ticks that full braking takes, halved, per position unit per tick of speed.
    half_braking: Factor,
    /// Multiples of the jerk in an acceleration of one position unit per tick squared.
    levels_per_unit: Factor,
    velocity: S::Gain,
    acceleration: S::Gain,
}

/// The memory of a ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RampState {
    position: Position,
    /// Of the position, below its unit.
    fraction: u32,
    velocity: Velocity,
    /// The acceleration in multiples of the jerk, signed.
    level: i32,
    /// The last tick took the rest that no multiple of the jerk makes: one tick without acceleration follows.
    landed: bool,
}

impl RampState {
    /// A ramp at rest.
    #[inline(always)]
    pub const fn at_rest(position: Position) -> Self {
        Self {
            position,
            fraction: 0,
            velocity: Velocity::ZERO,
            level: 0,
            landed: false,
        }
    }

    /// A ramp that continues another motion, `displacement` being its last tick's. The acceleration is taken to be
    /// zero; [`Ramp::take_over`] keeps it.
    #[inline(always)]
    pub(crate) const fn from_motion(position: Position, displacement: Position) -> Self {
        Self {
            velocity: Velocity::from_displacement(displacement),
            ..Self::at_rest(position)
        }
    }

    /// Position of the reference.
    pub const fn position(&self) -> Position {
        self.position
    }

    /// Velocity of the reference.
    pub const fn velocity(&self) -> Velocity {
        self.velocity
    }

    /// True if neither velocity nor acceleration is left.
    pub const fn is_at_rest(&self) -> bool {
        self.velocity.0 == 0 && self.level == 0
    }
}

impl<S: Scalar> Ramp<S> {
    /// A ramp within `acceleration_mm_s2` and `jerk_mm_s3`, both above zero; an infinite jerk leaves the acceleration
    /// alone limited. Both are rounded down, the acceleration to a multiple of the jerk. Settings time only.
    #[inline(never)]
    pub fn new(acceleration_mm_s2: f64, jerk_mm_s3: f64, scale: MotionScale) -> Self {
        let rate = scale.rate_hz;
        let acceleration = acceleration_mm_s2 * steps_per_mm(scale) / (rate * rate);
        let jerk = jerk_mm_s3 * steps_per_mm(scale) / (rate * rate * rate);
        let jerk = rounding::clamp(jerk.min(acceleration), 1.0, MAX_VELOCITY as f64);
        let jerk = rounding::floor(jerk);
        // T(levels) stays below the largest velocity.
        let most = libm::sqrt(MAX_VELOCITY as f64 / jerk).min(f64::from(i32::MAX));
        let levels = rounding::clamp(rounding::floor(acceleration / jerk), 1.0, most.max(1.0));
        let unit_mm = scale.resolution_mm / POSITION_UNITS_PER_COUNT;
        let one = libm::scalbn(1.0, FRACTION_BITS as i32);
        Self {
            jerk: jerk as i64,
            levels: levels as i32,
            half_braking: Factor::new(0.5 * one / (levels * jerk)),
            levels_per_unit: Factor::new(one / jerk),
            velocity: S::gain(
                libm::scalbn(unit_mm * rate, -(VELOCITY_BITS as i32)),
                Quantity::Integer,
                Quantity::Velocity,
            ),
            acceleration: S::gain(
                libm::scalbn(unit_mm * rate * rate, -(ACCELERATION_BITS as i32)),
                Quantity::Integer,
                Quantity::Acceleration,
            ),
        }
    }

    /// A ramp that continues another motion to stop it: `displacement` is its last tick's, `before` that of the tick
    /// before. An acceleration that already slows it down is kept, cut to the ramp's limit; one that still speeds it up
    /// is dropped at once, so that the stop stays within [`Ramp::stopping_distance`].
    pub fn take_over(
        &self,
        position: Position,
        displacement: Position,
        before: Position,
    ) -> RampState {
        let change = (displacement - before).clipped();
        let most = self.levels.unsigned_abs();
        let level = self
            .levels_per_unit
            .of(change.unsigned_abs())
            .min(most.into()) as i32;
        let slows = (change < 0) != (displacement.0 < 0) && displacement.0 != 0;
        RampState {
            level: match (slows, change < 0) {
                (false, _) => 0,
                (true, false) => level,
                (true, true) => -level,
            },
            ..RampState::from_motion(position, displacement)
        }
    }

    /// The level of a state. It may stem from a ramp with other limits, exchanged in flight.
    fn level(&self, state: &RampState) -> i32 {
        state.level.max(-self.levels).min(self.levels)
    }

    /// `T(level)`, of a level that is not negative.
    fn needed(&self, level: i32) -> i64 {
        let level = i64::from(level);
        self.jerk * (level * (level + 1) / 2)
    }

    /// The reference of the next tick: the velocity goes towards `target` as fast as the limits allow, and stays there
    /// once it is met. A target that changes in flight is followed at once; the velocity may pass a new target that
    /// is nearer than what the acceleration still brings.
    #[inline(never)]
    pub fn step(&self, state: &mut RampState, target: Velocity) -> ReferenceSample<S> {
        let missing = target.0 - state.velocity.0;
        let backward = missing < 0;
        // Seen from the side on which the velocity has to rise.
        let needed_units = missing.unsigned_abs() as i64;
        let before = self.level(state);
        let before = if backward { -before } else { before };
        let (level, may_land) = if before < 0 {
            (before + 1, false)
        } else if state.landed {
            (before, false)
        } else if before < self.levels && needed_units >= self.needed(before + 1) {
            (before + 1, false)
        } else if needed_units >= self.needed(before) {
            (before, true)
        } else {
            (before - 1, true)
        };
        // What remains at level zero is less than one multiple.
        let landing = if may_land && level == 0 {
            needed_units
        } else {
            0
        };
        let change = i64::from(level) * self.jerk + landing;
        let change = if backward { -change } else { change };
        state.level = if backward { -level } else { level };
        state.landed = landing != 0;
        state.velocity = Velocity::clamped(state.velocity.0 + change);

        let sum = i64::from(state.fraction) + state.velocity.0;
        state.fraction = sum as u32;
        state.position = state
            .position
            .saturating_add(Position(sum >> FRACTION_BITS));
        ReferenceSample {
            position: state.position,
            velocity: S::scale_wide(
                state.velocity.0 >> (FRACTION_BITS - VELOCITY_BITS),
                self.velocity,
            ),
            acceleration: S::scale_wide(
                change >> (FRACTION_BITS - ACCELERATION_BITS),
                self.acceleration,
            ),
        }
    }

    /// A displacement that a stop from `velocity`, without acceleration at its begin, does not exceed. For a stop that
    /// reaches full braking it is exact but for two ticks of travel; for a slower one the arithmetic mean stands for
    /// the geometric in `v sqrt(v / J) <= v / 2 (v / A + A / J)`.
    pub fn stopping_distance(&self, velocity: Velocity) -> Position {
        self.bound(velocity.speed_units(), 0)
    }

    /// Largest distances of a stop from this state towards smaller and towards larger positions; neither is negative.
    /// First the acceleration goes: meanwhile the speed still rises, or passes through rest.
    pub fn stop_reach(&self, state: &RampState) -> [Position; 2] {
        let signed = self.level(state);
        let level = signed.unsigned_abs();
        let needed = self.needed(signed.abs());
        let rise = if signed < 0 { -needed } else { needed };
        let speeds = [state.velocity.0, state.velocity.0.saturating_add(rise)];
        let [low, high] = [speeds[0].min(speeds[1]), speeds[0].max(speeds[1])];
        let reach = |speed: i64| {
            if speed > 0 {
                self.bound(Velocity::clamped(speed).speed_units(), level)
            } else {
                Position::ZERO
            }
        };
        [reach(-low), reach(high)]
    }

    /// The bound of a stop from a speed that is kept for `ticks` before braking begins.
    #[inline(always)]
    fn bound(&self, speed_units: u32, ticks: u32) -> Position {
        let rising = u64::from(self.levels.unsigned_abs() / 2);
        let ticks = self.half_braking.of(speed_units) + rising + u64::from(ticks) + MARGIN_TICKS;
        let distance = u64::from(speed_units).saturating_mul(ticks);
        Position(distance.min(i64::MAX as u64 / 2) as i64)
    }
}

/// Ticks of travel that a stop loses to whole ticks: half a level, the rests of the braking time and of its half, and
/// the ticks at which a level is held.
const MARGIN_TICKS: u64 = 3;

/// A positive factor: a mantissa, rounded up, and the bits to drop from the product with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Factor {
    mantissa: u32,
    shift: u32,
}

impl Factor {
    /// The factor above zero; from 2^32 on it saturates.
    fn new(value: f64) -> Self {
        let (fraction, power) = libm::frexp(value);
        let excess = (-31 - power).max(0);
        // `as` saturates.
        Self {
            mantissa: rounding::ceil(libm::scalbn(fraction, 32 - excess)) as u32,
            shift: (32 - power - excess).max(0) as u32,
        }
    }

    const fn of(self, value: u32) -> u64 {
        (value as u64 * self.mantissa as u64) >> self.shift
    }
}
