//! From checked settings to what the tick reads.

use super::{
    AmplifierSettings, AxisSettings, LimitSettings, PlanSettings, SettingsError, StageSettings,
};
use crate::law::axis::{Amplifier, Axis};
use crate::law::course::Course;
use crate::law::encoder::Encoder;
use crate::law::reference::{Motion, MotionScale, Ramp, Stream, Velocity};
use crate::law::rounding;
use crate::law::safety::AxisName;
use crate::law::safety::monitor::{Following, IndexSpacing, Overspeed, Silence};
use crate::law::safety::travel::Travel;
use crate::law::scalar::{Quantity, Scalar};
use crate::law::stage::{Plan, Stage};
use crate::law::units::{DacCode, POSITION_UNITS_PER_COUNT, Position};

impl StageSettings {
    /// Checks the settings and builds the stage, with room for `N` GMS elements. Slow: tables are filled and the
    /// Popov bound is searched.
    ///
    /// # Errors
    /// The first field that is refused; see [`StageSettings::validate`].
    pub fn build<S: Scalar, const N: usize>(&self) -> Result<Stage<S, N>, SettingsError> {
        self.validate(N)?;
        Ok(Stage {
            axes: AxisName::ALL.map(|axis| self.build_axis(axis)),
            streaming: self.streaming.build(),
        })
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
        let (encoder, amplifier) = (&self.encoder, &self.amplifier);
        let (feedback, feedforward) = (&self.feedback, &self.feedforward);
        let largest_step = 2.0 * self.limits.max_velocity_mm_s * period_s / encoder.resolution_mm;
        let scale = MotionScale {
            resolution_mm: encoder.resolution_mm,
            rate_hz: 1.0 / period_s,
        };
        axis.encoder = Encoder::new(
            encoder.counter_bits.into(),
            encoder.reversed,
            // One count more: a slow axis still steps by whole counts, and noise adds one.
            rounding::ceil(largest_step) as i32 + 1,
        );
        let unit_mm = encoder.resolution_mm / POSITION_UNITS_PER_COUNT;
        axis.unit_mm = S::gain(unit_mm, Quantity::Integer, Quantity::Length);
        axis.unit_mm_s = S::gain(unit_mm / period_s, Quantity::Integer, Quantity::Velocity);
        axis.feedback = feedback.build(period_s);
        axis.feedforward.build_over(
            feedforward.kind,
            &feedforward.gains,
            &self.friction,
            period_s,
        );
        axis.preview_ticks = preview_ticks;
        axis.amplifier = amplifier.build();
        axis.following = self.limits.build_following();
        axis.overspeed = Overspeed::new(self.limits.overspeed_ratio * 0.5 * largest_step);
        axis.silence = Silence {
            level: S::quantise(
                self.limits.silent_share * amplifier.output_limit_v,
                Quantity::Voltage,
            ),
            ticks: rounding::round(self.limits.silent_s / period_s) as u32,
        };
        axis.index = IndexSpacing::new(encoder.counts_per_index, encoder.index_tolerance_counts);
        let wait_ticks = (longest_preview_ticks - preview_ticks) as u32;
        axis.course = self.build_course(scale, wait_ticks);
        axis.travel = self.limits.build_travel(scale, &axis.course.braking);
        axis.transfer_decay = S::quantise(
            libm::exp(-period_s / feedback.transfer_s),
            Quantity::Fraction,
        );
    }

    #[inline(never)]
    fn build_course<S: Scalar>(&self, scale: MotionScale, wait_ticks: u32) -> Course<S> {
        let limits = &self.limits;
        Course {
            braking: Ramp::new(limits.braking_mm_s2, limits.braking_jerk_mm_s3, scale),
            moving: Ramp::new(limits.max_acceleration_mm_s2, limits.max_jerk_mm_s3, scale),
            fastest: Velocity::from_mm_s(limits.max_velocity_mm_s, scale),
            span: limits.travel_mm.as_ref().map(|travel| {
                let position = |value_mm| Position::from_mm(value_mm, scale.resolution_mm);
                (position(travel.negative), position(travel.positive))
            }),
            homing: self.build_homing(scale),
            stream: Stream::new(scale),
            wait_ticks,
        }
    }
}

impl AmplifierSettings {
    fn build<S: Scalar>(&self) -> Amplifier<S> {
        let sign = if self.reversed { -1.0 } else { 1.0 };
        let codes_per_volt = DacCode::FULL_SCALE / self.full_scale_v;
        Amplifier {
            limit: S::quantise(self.output_limit_v, Quantity::Voltage),
            codes_per_volt: S::gain(sign * codes_per_volt, Quantity::Voltage, Quantity::Integer),
            offset_code: rounding::round(self.offset_v * codes_per_volt) as i32,
        }
    }
}

impl LimitSettings {
    fn build_following<S: Scalar>(&self) -> Following<S> {
        Following {
            at_rest: S::quantise(self.following_error_mm, Quantity::Length),
            per_speed: S::gain(
                self.following_error_lag_s,
                Quantity::Velocity,
                Quantity::Length,
            ),
            largest: S::quantise(self.following_error_max_mm, Quantity::Length),
        }
    }

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
        Ok(core::array::from_fn(|index| {
            Motion::build(&self.motions[index], stage.motion_scale(index))
        }))
    }
}
