//! From checked settings to what the tick reads.

use super::{AxisSettings, PlanSettings, SettingsError, StageSettings};
use crate::axis::{Amplifier, Axis};
use crate::encoder::Encoder;
use crate::feedforward::Feedforward;
use crate::reference::{Motion, MotionScale};
use crate::scalar::{Quantity, Scalar};
use crate::stage::{Plan, Stage};
use crate::units::{DacCode, POSITION_UNITS_PER_COUNT};

impl StageSettings {
    /// Checks the settings and builds the stage, with room for `N` GMS elements. Slow: tables are filled and the
    /// Popov bound is searched.
    ///
    /// # Errors
    /// The first field that is refused; see [`StageSettings::validate`].
    pub fn build<S: Scalar, const N: usize>(&self) -> Result<Stage<S, N>, SettingsError> {
        self.validate(N)?;
        let period_s = 1.0 / self.rate_hz;
        let [x, y, z] = &self.axes;
        let previews = self
            .axes
            .each_ref()
            .map(|axis| axis.preview_ticks(period_s));
        let longest = previews.into_iter().fold(0, usize::max);
        Ok(Stage {
            axes: [x, y, z].map(|axis| axis.build(period_s, longest)),
        })
    }

    /// The scale of the motions of axis `index` (0 to 2).
    pub fn motion_scale(&self, index: usize) -> MotionScale {
        MotionScale {
            resolution_mm: self.axes[index].encoder.resolution_mm,
            rate_hz: self.rate_hz,
        }
    }
}

impl AxisSettings {
    /// The preview in whole ticks.
    fn preview_ticks(&self, period_s: f64) -> usize {
        libm::round(self.feedforward.preview_s / period_s) as usize
    }

    /// `longest_preview_ticks` is the stage's.
    fn build<S: Scalar, const N: usize>(
        &self,
        period_s: f64,
        longest_preview_ticks: usize,
    ) -> Axis<S, N> {
        let preview_ticks = self.preview_ticks(period_s);
        let (encoder, amplifier) = (&self.encoder, &self.amplifier);
        let (feedback, feedforward) = (&self.feedback, &self.feedforward);
        let largest_step = 2.0 * self.limits.max_velocity_mm_s * period_s / encoder.resolution_mm;
        let sign = if amplifier.reversed { -1.0 } else { 1.0 };
        let codes_per_volt = DacCode::FULL_SCALE / amplifier.full_scale_v;
        Axis {
            encoder: Encoder::new(
                encoder.counter_bits.into(),
                encoder.reversed,
                // One count more: a slow axis still steps by whole counts, and noise adds one.
                libm::ceil(largest_step) as i32 + 1,
            ),
            unit_mm: S::gain(
                encoder.resolution_mm / POSITION_UNITS_PER_COUNT,
                Quantity::Integer,
                Quantity::Length,
            ),
            unit_mm_s: S::gain(
                encoder.resolution_mm / POSITION_UNITS_PER_COUNT / period_s,
                Quantity::Integer,
                Quantity::Velocity,
            ),
            feedback: feedback.build(period_s),
            feedforward: Feedforward::build(
                feedforward.kind,
                &feedforward.gains,
                &self.friction,
                period_s,
            ),
            preview_ticks,
            wait_ticks: (longest_preview_ticks - preview_ticks) as u32,
            amplifier: Amplifier {
                limit: S::quantise(amplifier.output_limit_v, Quantity::Voltage),
                codes_per_volt: S::gain(
                    sign * codes_per_volt,
                    Quantity::Voltage,
                    Quantity::Integer,
                ),
                offset_code: libm::round(amplifier.offset_v * codes_per_volt) as i32,
            },
            following_error_limit: S::quantise(self.limits.following_error_mm, Quantity::Length),
            transfer_decay: S::quantise(
                libm::exp(-period_s / feedback.transfer_s),
                Quantity::Fraction,
            ),
        }
    }
}

impl PlanSettings {
    /// Checks the motions against the stage's limits and builds them.
    ///
    /// # Errors
    /// The first field that is refused; see [`PlanSettings::validate`].
    pub fn build<S: Scalar>(&self, stage: &StageSettings) -> Result<Plan<S>, SettingsError> {
        self.validate(stage)?;
        Ok(core::array::from_fn(|index| {
            Motion::build(&self.motions[index], stage.motion_scale(index))
        }))
    }
}
