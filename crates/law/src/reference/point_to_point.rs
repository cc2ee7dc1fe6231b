//! A jerk-limited move from one point to another.
//!
//! The profile is a step of position smoothed by three moving averages, whose lengths set the limits of velocity,
//! acceleration and jerk. In the tick it is four integer sums driven by eight impulses, so it is exact and ends on the
//! target to the last unit. Source: Biagiotti and Melchiorri, *FIR filters for online trajectory planning with time-
//! and frequency-domain specifications*, Control Engineering Practice 20 (2012).

use super::motion::PlannedStroke;
use super::motion_state::MotionState;
use super::sample::{MotionScale, ReferenceSample};
use crate::rounding;
use crate::scalar::{Quantity, Scalar};
use crate::units::{POSITION_UNITS_PER_COUNT, Position};

/// A move as a person writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct PointToPointSettings {
    /// Signed distance, mm.
    pub distance_mm: f64,
    /// Largest velocity, mm/s; above zero.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration, mm/s^2; above zero.
    pub max_acceleration_mm_s2: f64,
    /// Largest jerk, mm/s^3; above zero.
    pub max_jerk_mm_s3: f64,
}

impl PointToPointSettings {
    /// The lengths of the three moving averages, s: of velocity, acceleration and jerk. A distance too short to reach
    /// a limit lowers the peak, not the time that smoothing takes.
    fn durations_s(&self) -> [f64; 3] {
        let distance = libm::fabs(self.distance_mm);
        if distance == 0.0 {
            return [0.0; 3];
        }
        let (acceleration, jerk) = (self.max_acceleration_mm_s2, self.max_jerk_mm_s3);
        // The peak velocity of a move without a stretch at constant velocity solves D/v = v/a + a/j.
        let rise = acceleration / jerk;
        let reachable =
            0.5 * acceleration * (libm::sqrt(rise * rise + 4.0 * distance / acceleration) - rise);
        let velocity = self.max_velocity_mm_s.min(reachable);
        if velocity / acceleration >= rise {
            return [distance / velocity, velocity / acceleration, rise];
        }
        // Not even the acceleration is reached: D = 2 j T^3 if velocity does not cut in first, v = j T^2.
        let time =
            libm::cbrt(distance / (2.0 * jerk)).min(libm::sqrt(self.max_velocity_mm_s / jerk));
        [distance / (jerk * time * time), time, time]
    }

    /// Duration of the move, s, but for rounding to whole ticks.
    pub fn duration_s(&self) -> f64 {
        self.durations_s().iter().sum()
    }
}

/// Fraction bits of the sums beyond those of a [`Position`].
pub(super) const FRACTION_BITS: u32 = 64;
/// Bits dropped from a sum before it becomes a velocity.
const VELOCITY_SHIFT: u32 = 52;
/// Bits dropped from a sum before it becomes an acceleration.
const ACCELERATION_SHIFT: u32 = 48;

/// A move ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct PointToPoint<S: Scalar> {
    /// Ticks at which the jerk steps up (`true`) or down.
    pub(super) impulses: [(u32, bool); 8],
    pub(super) step: i128,
    pub(super) target: Position,
    velocity: S::Gain,
    acceleration: S::Gain,
    stroke: PlannedStroke,
}

impl<S: Scalar> PointToPoint<S> {
    /// Builds the move from validated settings. Settings time only.
    pub(super) fn build(settings: &PointToPointSettings, scale: MotionScale) -> Self {
        let target = Position::from_mm(settings.distance_mm, scale.resolution_mm);
        let [velocity, acceleration, jerk] = settings
            .durations_s()
            .map(|seconds| (rounding::ceil(seconds * scale.rate_hz) as u32).max(1));
        // Rounded up one by one, they could overlap by a tick, and their jerks add.
        let acceleration = acceleration.max(jerk);
        let velocity = velocity.max(acceleration.saturating_add(jerk));
        let ticks = [velocity, acceleration, jerk];
        let mut impulses = [(0_u32, true); 8];
        for (subset, impulse) in impulses.iter_mut().enumerate() {
            for (index, length) in ticks.iter().enumerate() {
                if subset >> index & 1 == 1 {
                    impulse.0 = impulse.0.saturating_add(*length);
                    impulse.1 = !impulse.1;
                }
            }
        }
        impulses.sort_unstable();
        let product: i128 = ticks.iter().map(|&length| i128::from(length)).product();
        let unit_mm = scale.resolution_mm / POSITION_UNITS_PER_COUNT;
        let gain = |shift: u32, per_tick: f64, to| {
            let value = libm::scalbn(unit_mm * per_tick, shift as i32 - FRACTION_BITS as i32);
            S::gain(value, Quantity::Integer, to)
        };
        Self {
            impulses,
            stroke: PlannedStroke::new(
                target,
                libm::fabs(settings.distance_mm) / (scale.resolution_mm * f64::from(velocity)),
            ),
            step: (i128::from(target.0) << FRACTION_BITS) / product,
            target,
            velocity: gain(VELOCITY_SHIFT, scale.rate_hz, Quantity::Velocity),
            acceleration: gain(
                ACCELERATION_SHIFT,
                scale.rate_hz * scale.rate_hz,
                Quantity::Acceleration,
            ),
        }
    }

    pub(super) const fn stroke(&self) -> PlannedStroke {
        self.stroke
    }

    // Not inlined: its wide integers would crowd the registers of the motions that run for hours.
    #[inline(never)]
    pub(super) fn step(&self, state: &mut MotionState) -> ReferenceSample<S> {
        let chain = &mut state.chain;
        // At most eight, as many as there are impulses.
        while let Some(&(tick, up)) = self.impulses.get(usize::from(chain.impulse)) {
            if tick != state.elapsed {
                break;
            }
            chain.jerk = chain.jerk.wrapping_add(if up {
                self.step
            } else {
                self.step.wrapping_neg()
            });
            chain.impulse += 1;
        }
        if usize::from(chain.impulse) == self.impulses.len() {
            return ReferenceSample {
                position: self.target,
                ..ReferenceSample::default()
            };
        }
        chain.acceleration = chain.acceleration.wrapping_add(chain.jerk);
        chain.velocity = chain.velocity.wrapping_add(chain.acceleration);
        chain.position = chain.position.wrapping_add(chain.velocity);
        ReferenceSample {
            position: Position((chain.position >> FRACTION_BITS) as i64),
            velocity: S::scale_wide((chain.velocity >> VELOCITY_SHIFT) as i64, self.velocity),
            acceleration: S::scale_wide(
                (chain.acceleration >> ACCELERATION_SHIFT) as i64,
                self.acceleration,
            ),
        }
    }

    pub(super) fn finished(&self, state: &MotionState) -> bool {
        usize::from(state.chain.impulse) == self.impulses.len()
    }
}
