//! A move whose distance is known in the tick alone, such as the one from the home mark to the parking position.
//!
//! It is a [`PointToPoint`] whose three moving averages last powers of two of ticks: then aiming it takes shifts and no
//! division, and its sums are exact.

use super::point_to_point::{FRACTION_BITS, PointToPoint, PointToPointSettings};
use super::sample::MotionScale;
use crate::rounding;
use crate::scalar::Scalar;
use crate::units::Position;

/// The longest average, as a power of two of ticks: 30 hours at 10 kHz.
const MOST_EXPONENT: u32 = 30;

/// The limits of an approach, ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Approach<S: Scalar> {
    /// Carries the gains; its distance is another.
    template: PointToPoint<S>,
    /// The displacement of a tick at the largest velocity.
    fastest: i64,
    /// Averages of acceleration and jerk, as powers of two of ticks.
    acceleration: u32,
    jerk: u32,
}

/// The power of two of ticks that is at least `seconds`.
fn exponent(seconds: f64, rate_hz: f64) -> u32 {
    let ticks = rounding::ceil(seconds * rate_hz).max(1.0) as u32;
    (u32::BITS - (ticks - 1).leading_zeros()).min(MOST_EXPONENT / 2)
}

impl<S: Scalar> Approach<S> {
    /// An approach within `max_velocity_mm_s`, `max_acceleration_mm_s2` and `max_jerk_mm_s3`; rounding to powers of two makes
    /// it up to twice as long as these ask for. Settings time only.
    pub fn new(
        max_velocity_mm_s: f64,
        max_acceleration_mm_s2: f64,
        max_jerk_mm_s3: f64,
        scale: MotionScale,
    ) -> Self {
        let settings = PointToPointSettings {
            distance_mm: 0.0,
            max_velocity_mm_s,
            max_acceleration_mm_s2,
            max_jerk_mm_s3,
        };
        let jerk = exponent(max_acceleration_mm_s2 / max_jerk_mm_s3, scale.rate_hz);
        let per_tick = Position::from_mm(max_velocity_mm_s / scale.rate_hz, scale.resolution_mm);
        Self {
            template: PointToPoint::build(&settings, scale),
            fastest: per_tick.0.max(1),
            acceleration: exponent(max_velocity_mm_s / max_acceleration_mm_s2, scale.rate_hz)
                .max(jerk),
            jerk,
        }
    }

    /// The move over `distance`.
    pub(crate) fn aim(&self, distance: Position) -> PointToPoint<S> {
        // Longer than both others together, so that the order of the impulses is known.
        let mut velocity = self.acceleration + 1;
        let most = distance.0.unsigned_abs();
        while velocity < MOST_EXPONENT && (self.fastest.unsigned_abs() << velocity) < most {
            velocity += 1;
        }
        let [long, middle, short] = [velocity, self.acceleration, self.jerk].map(|bits| 1 << bits);
        let impulses = [
            (0, true),
            (short, false),
            (middle, false),
            (short + middle, true),
            (long, false),
            (long + short, true),
            (long + middle, true),
            (long + middle + short, false),
        ];
        // At most 30 + 15 + 15 bits of the 64: nothing is lost.
        let shift = FRACTION_BITS - (velocity + self.acceleration + self.jerk);
        let mut aimed = self.template.clone();
        aimed.impulses = impulses;
        aimed.step = i128::from(distance.0) << shift;
        aimed.target = distance;
        aimed
    }
}
