//! The settings of a reference that another control gives by step and direction.

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

use super::axis::AxisSettings;
use super::leaves::default;
use quadrant_law::reference::{MotionScale, PulseReference, PulseScale};
use quadrant_law::rounding;
use quadrant_law::scalar::Scalar;

/// Step and direction of another control, which leads the axis while its enabling line is on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct PulseSettings {
    /// Length of a step before the gear, mm.
    pub step_mm: f64,
    /// Numerator of the electronic gear.
    pub gear_numerator: u32,
    /// Denominator of the electronic gear.
    pub gear_denominator: u32,
    /// True if a step with the direction line on moves the axis to larger positions.
    pub reversed: bool,
    /// Delay of the reference behind the steps, s: that of the moving averages.
    pub delay_s: f64,
}

impl Default for PulseSettings {
    /// No gear; the length of a step must be given.
    fn default() -> Self {
        Self {
            step_mm: default!("pulses.step_mm"),
            gear_numerator: default!("pulses.gear_numerator") as u32,
            gear_denominator: default!("pulses.gear_denominator") as u32,
            reversed: false,
            delay_s: default!("pulses.delay_s"),
        }
    }
}

impl PulseSettings {
    /// Length of a step behind the gear, mm.
    pub fn geared_step_mm(&self) -> f64 {
        self.step_mm * f64::from(self.gear_numerator) / f64::from(self.gear_denominator)
    }
}

impl AxisSettings {
    /// The reference of the pulses, if the axis follows any. `wait_ticks`: by how much its preview is shorter than the longest.
    #[inline(never)]
    pub(super) fn build_pulses<S: Scalar>(
        &self,
        scale: MotionScale,
        preview_ticks: usize,
        wait_ticks: usize,
    ) -> Option<PulseReference<S>> {
        let pulses = self.pulses?;
        let step_mm = pulses.geared_step_mm();
        let scaled = PulseScale {
            step_mm: if pulses.reversed { -step_mm } else { step_mm },
            counter_bits: 32,
            delay_ticks: rounding::round(pulses.delay_s * scale.rate_hz) as u32,
            wait_ticks: wait_ticks as u32,
            preview_ticks: preview_ticks as u32,
            max_velocity_mm_s: self.limits.max_velocity_mm_s,
            max_acceleration_mm_s2: self.limits.max_acceleration_mm_s2,
        };
        Some(PulseReference::new(&scaled, scale))
    }
}
