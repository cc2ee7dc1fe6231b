//! From checked settings to what the tick reads.

use super::{AxisSettings, LimitSettings, PlanSettings, SettingsError, StageSettings};
use crate::law::axes::{AxisName, PerAxis};
use crate::law::axis::{Axis, AxisBuilder};
use crate::law::encoder::Encoder;
use crate::law::motion::ReferenceGenerator;
use crate::law::reference::{Motion, MotionScale, Ramp, Velocity};
use crate::law::rounding;
use crate::law::safety::monitor::{Following, IndexSpacing, Overspeed, SignalLoss};
use crate::law::safety::travel::Travel;
use crate::law::scalar::Scalar;
use crate::law::stage::{Plan, Stage};
use crate::law::units::Position;

impl StageSettings {
    /// Checks the settings and builds the stage, with room for `N` GMS elements. Slow: tables are filled and the
    /// Popov bound is searched.
    ///
    /// # Errors
    /// The first field that is refused; see [`StageSettings::validate`].
    pub fn build<S: Scalar, const N: usize>(&self) -> Result<Stage<S, N>, SettingsError> {
        self.validate(N)?;
        Ok(Stage::new(
            PerAxis::from_fn(|axis| self.build_axis(axis)),
            self.streaming.build(),
        ))
    }

    /// Builds one axis of settings that [`validate`](Self::validate) has accepted, to be put in the place of another in a
    /// [`StageRef`](crate::law::stage::StageRef). How long an axis waits at the start of a motion depends on the longest preview
    /// of all: a change of that concerns every axis. Slow, as the build of the stage.
    pub fn build_axis<S: Scalar, const N: usize>(&self, axis: AxisName) -> Axis<S, N> {
        let mut built = Axis::blank();
        self.build_axis_into(axis, &mut built);
        built
    }

    /// As [`build_axis`](Self::build_axis), in the place of an axis that is no longer used: what was there does not
    /// matter, and nothing of an axis' size is on the stack.
    pub fn build_axis_into<S: Scalar, const N: usize>(
        &self,
        axis: AxisName,
        place: &mut Axis<S, N>,
    ) {
        let longest = self.longest_preview_ticks();
        self.axis(axis)
            .build_into(1.0 / self.rate_hz, longest, place);
    }

    /// The longest preview of any axis: the others wait for it.
    pub(super) fn longest_preview_ticks(&self) -> usize {
        let ticks = |axis: &AxisSettings| axis.preview_ticks(1.0 / self.rate_hz);
        self.axes.iter().map(ticks).fold(0, usize::max)
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
    #[inline(never)]
    fn preview_ticks(&self, period_s: f64) -> usize {
        rounding::round(self.feedforward.preview_s / period_s) as usize
    }

    /// `longest_preview_ticks` is the stage's.
    // Field by field: no temporary is as large as the axis.
    #[inline(never)]
    fn build_into<S: Scalar, const N: usize>(
        &self,
        period_s: f64,
        longest_preview_ticks: usize,
        axis: &mut Axis<S, N>,
    ) {
        let preview_ticks = self.preview_ticks(period_s);
        let (encoder, amplifier, limits) = (&self.encoder, &self.amplifier, &self.limits);
        let (feedback, feedforward) = (&self.feedback, &self.feedforward);
        let largest_step = 2.0 * limits.max_velocity_mm_s * period_s / encoder.resolution_mm;
        let scale = MotionScale {
            resolution_mm: encoder.resolution_mm,
            rate_hz: 1.0 / period_s,
        };
        let stop_ramp = Ramp::new(limits.braking_mm_s2, limits.braking_jerk_mm_s3, scale);
        let built = AxisBuilder::new(axis, encoder.resolution_mm, period_s)
            .encoder(Encoder::new(
                encoder.counter_bits.into(),
                encoder.reversed,
                // One count more: a slow axis still steps by whole counts, and noise adds one.
                rounding::ceil(largest_step) as i32 + 1,
            ))
            .amplifier(
                amplifier.output_limit_v,
                amplifier.full_scale_v,
                amplifier.offset_v,
                amplifier.reversed,
            )
            .feedback(feedback.build(period_s))
            .feedforward(
                feedforward.kind,
                &feedforward.gains,
                &self.friction,
                preview_ticks,
            )
            .bumpless(feedback.transfer_s)
            .following(Following::new(
                limits.following_error_mm,
                limits.following_error_lag_s,
                limits.following_error_max_mm,
            ))
            .overspeed(Overspeed::new(limits.overspeed_ratio * 0.5 * largest_step))
            .signal_loss(SignalLoss::new(
                limits.silent_share * amplifier.output_limit_v,
                rounding::round(limits.silent_s / period_s) as u32,
            ))
            .index_spacing(IndexSpacing::new(
                encoder.counts_per_index,
                encoder.index_tolerance_counts,
            ))
            .travel(limits.build_travel(scale, &stop_ramp))
            .generator(self.build_generator(
                stop_ramp,
                (longest_preview_ticks - preview_ticks) as u32,
                scale,
            ))
            .try_build();
        debug_assert_eq!(built, Ok(()), "validation accepted what an axis refuses");
    }

    #[inline(never)]
    fn build_generator<S: Scalar>(
        &self,
        stop_ramp: Ramp<S>,
        wait_ticks: u32,
        scale: MotionScale,
    ) -> ReferenceGenerator<S> {
        let limits = &self.limits;
        let position = |value_mm| Position::from_mm(value_mm, scale.resolution_mm);
        ReferenceGenerator::new(
            stop_ramp,
            Ramp::new(limits.max_acceleration_mm_s2, limits.max_jerk_mm_s3, scale),
            Velocity::from_mm_s(limits.max_velocity_mm_s, scale),
            scale,
        )
        .with_soft_limits(
            limits
                .travel_mm
                .as_ref()
                .map(|travel| (position(travel.negative), position(travel.positive))),
        )
        .with_homing(self.build_homing(scale))
        .with_wait(wait_ticks)
    }
}

impl LimitSettings {
    fn build_travel<S: Scalar>(&self, scale: MotionScale, braking: &Ramp<S>) -> Travel {
        let Some(travel) = self.travel_mm else {
            return Travel::UNLIMITED;
        };
        let position = |value_mm| Position::from_mm(value_mm, scale.resolution_mm);
        let beyond = position(0.5 * self.following_error_mm);
        // References are rounded to units of a position.
        let rounding = Position(2);
        let period_s = 1.0 / scale.rate_hz;
        Travel::new(
            position(travel.negative) - beyond,
            position(travel.positive) + beyond,
            position(self.max_velocity_mm_s * period_s) + rounding,
            position(self.max_acceleration_mm_s2 * period_s * period_s) + rounding,
            braking,
        )
    }
}

impl PlanSettings {
    /// Checks the motions against the stage's limits and builds them.
    ///
    /// # Errors
    /// The first field that is refused; see [`PlanSettings::validate`].
    pub fn build<S: Scalar>(&self, stage: &StageSettings) -> Result<Plan<S>, SettingsError> {
        self.validate(stage)?;
        Ok(PerAxis::from_fn(|axis| {
            let index = axis as usize;
            Motion::build(&self.motions[index], stage.motion_scale(index))
        }))
    }
}
