//! Homing for the tick, from checked settings.

use super::axis::AxisSettings;
use super::homing::HomeSwitch;
use quadrant_law::friction::Direction;
use quadrant_law::homing::{Homing, HomingParameters};
use quadrant_law::reference::{Approach, MotionScale, Velocity};
use quadrant_law::rounding;
use quadrant_law::safety::AxisSwitches;
use quadrant_law::scalar::Scalar;
use quadrant_law::units::{EncoderCount, POSITION_UNITS_PER_COUNT, Position};

/// Rest of an axis before its origin is defined, s: many times the longest preview at the usual control rates.
const SETTLE_S: f64 = 0.02;

impl AxisSettings {
    /// Homing ready for the tick, if the axis has any.
    pub(super) fn build_homing<S: Scalar>(&self, scale: MotionScale) -> Option<Homing<S>> {
        let homing = self.homing.as_ref()?;
        let resolution_mm = scale.resolution_mm;
        let search_mm_s = homing
            .search_mm_s
            .min(self.limits.max_velocity_mm_s)
            .min(self.limits.unhomed_mm_s.unwrap_or(f64::INFINITY));
        let park_mm = match &self.limits.travel_mm {
            Some(travel) => homing.park_mm.max(travel.negative).min(travel.positive),
            None => homing.park_mm,
        };
        let spacing = self.encoder.counts_per_index.filter(|_| homing.index);
        let whole_counts =
            rounding::round(homing.mark_mm / resolution_mm) * POSITION_UNITS_PER_COUNT;
        let parameters = HomingParameters {
            direction: homing.direction,
            switch: match (homing.switch, homing.direction) {
                (HomeSwitch::Home, _) => AxisSwitches::HOME,
                (HomeSwitch::Limit, Direction::Negative) => AxisSwitches::NEGATIVE_LIMIT,
                (HomeSwitch::Limit, Direction::Positive) => AxisSwitches::POSITIVE_LIMIT,
            },
            search_velocity: Velocity::from_mm_s(search_mm_s, scale),
            creep_velocity: Velocity::from_mm_s(homing.latch_mm_s.min(search_mm_s), scale),
            debounce_ticks: rounding::round(homing.debounce_s * scale.rate_hz) as u32,
            settle_ticks: rounding::round(SETTLE_S * scale.rate_hz) as u32,
            index_spacing: spacing.map(|counts| EncoderCount(counts.into()).position()),
            home_offset: Position(whole_counts as i64),
            parking: Position::from_mm(park_mm, resolution_mm),
            travel: Position::from_mm(homing.travel_mm, resolution_mm),
        };
        let approach = Approach::new(
            search_mm_s,
            self.limits.max_acceleration_mm_s2,
            self.limits.max_jerk_mm_s3,
            scale,
        );
        Some(Homing::new(parameters, approach))
    }
}
