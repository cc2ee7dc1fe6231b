//! From checked settings to what the tick reads.

use super::{
    AmplifierSettings, AxisSettings, LimitSettings, PlanSettings, SettingsError, StageSettings,
};
use crate::cancelling::NominalLoop;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::axis::{Axis, AxisBuilder, Commissioning, OutputStage};
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::pid::PidGains;
use quadrant_law::encoder::Encoder;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::stribeck::StribeckCurve;
use quadrant_law::learning::{Learning, LearningLoop};
use quadrant_law::motion::ReferenceGenerator;
use quadrant_law::reference::{Motion, MotionScale, Ramp, Velocity};
use quadrant_law::rounding;
use quadrant_law::safety::monitor::{Following, IndexSpacing, Overspeed, SignalLoss};
use quadrant_law::safety::oscillation::Oscillation;
use quadrant_law::safety::overload::Overload;
use quadrant_law::safety::plausibility::{OutputScale, Plausibility, PlausibilityModel};
use quadrant_law::safety::travel::Travel;
use quadrant_law::safety::{Brake, Operation};
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Plan, Stage};
use quadrant_law::units::{DacCode, Position};

/// Counts that a step of an axis may have however slow: noise of 3 counts RMS makes up to 26 in the difference of two readings.
const LEAST_STEP_COUNTS: i32 = 32;
/// Counts that an axis shows for certain: those of one dead line, and noise.
const HELD_COUNTS: f64 = 5.0;
/// Largest ratio of what friction takes up before it yields by these counts to what the settings say.
const HELD_ERROR: f64 = 2.0;
/// Largest breakaway over that of the settings that need not show as motion in open loop.
const FRICTION_ERROR: f64 = 1.5;
/// Breakaway over that of the settings below which silence of the encoder is no fault.
const SILENT_FRICTIONS: f64 = 2.0;
/// Least share of breakaway that friction takes up, even if the settings call it stiffer.
const HELD_FRICTIONS: f64 = 0.65;
/// Friction that eases under a vibration while an axis stands, over breakaway.
const EASED_FRICTIONS: f64 = 1.5;
/// Largest share of breakaway that friction takes up once more after it eased.
const REGAINED_FRICTIONS: f64 = 0.25;
/// Friction of an axis that stands after it slid, over breakaway.
const STUCK_FRICTIONS: f64 = 0.75;
/// The same on an axis that slides.
const SLIDING_FRICTIONS: f64 = 1.0;
/// The same on an axis that is turned around: twice 1.4 of breakaway and some more.
const TURNED_FRICTIONS: f64 = 3.0;
/// Largest voltage that an axis takes up when it is turned around, over that of the settings.
const MOST_TURNED: f64 = 1.5;
/// Voltage with which the law answers a displacement, over its proportional gain: the integral's answer comes to it.
const ANSWER_ERROR: f64 = 3.0;
/// Least motion that turns an axis around, mm.
const TURN_MM: f64 = 0.032;
/// The same in counts: noise of some counts stays below.
const TURN_COUNTS: f64 = 16.0;
/// Least motion that shows that an axis is alive, counts.
const ALIVE_COUNTS: f64 = 64.0;
/// Distance of the model ahead of an axis that does not follow, mm.
const AHEAD_MM: f64 = 0.2;
/// Breakaway of the settings that is a load that there may be, however small the output limit is, at first and later.
const FIRST_LOAD_FRICTIONS: f64 = 3.0;
/// Largest load over the output limit.
const LOAD_SHARE: f64 = 0.3;
/// The same before the axis has moved by [`PROVING_MM`] after enabling.
const FIRST_LOAD_SHARE: f64 = 0.1;
/// Distance after enabling from which on [`LOAD_SHARE`] counts, mm.
const PROVING_MM: f64 = 1.0;
/// Distance of the model without motion of the encoder that is a fault, mm.
const MODEL_DISTANCE_MM: f64 = 0.05;
/// The same in counts.
const MODEL_COUNTS: f64 = 20.0;
/// The addition to that distance for the error of the dead time, over gain times largest output times its square: a fifth of the
/// way that this output brings within it.
const DELAY_ERROR: f64 = 0.1;
/// The addition for friction that breaks away or is turned around: the way that its level brings within this time, s.
const FRICTION_S: f64 = 3.5e-3;
/// Speed that no load explains, mm/s.
const MODEL_VELOCITY_MM_S: f64 = 80.0;
/// The same in counts per tick.
const MODEL_STEP_COUNTS: f64 = 8.0;
/// Measured speed below which an axis stands, beyond what quantisation adds, mm/s: noise of some counts stays below.
const STANDSTILL_MM_S: f64 = 5.0;
/// Ticks that are added to the longest stop, for rounding.
const STOP_MARGIN_TICKS: u32 = 10;
/// Budget of the open loop on an axis without a model, V s.
const OPEN_BUDGET_V_S: f64 = 8e-3;
/// Breakaway of such an axis over the output limit: less voltage does not count in this budget.
const OPEN_SHARE: f64 = 0.02;

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
            self.operation(),
        ))
    }

    /// Builds one axis of settings that [`validate`](Self::validate) has accepted, to be put in the place of another in a
    /// [`StageRef`](quadrant_law::stage::StageRef). How long an axis waits at the start of a motion depends on the longest preview
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

    /// The rules of operation as the tick reads them.
    pub fn operation(&self) -> Operation {
        Operation {
            enabled_by: self.operation.enabled_by,
            host_needed: self.operation.host_needed,
            emergency_stop: self.operation.emergency_stop.into(),
            link_lost: self.streaming.link_lost.into(),
            underrun: self.streaming.underrun.into(),
            brake: Brake {
                release_ticks: rounding::ceil(self.brake.release_s * self.rate_hz) as u32,
                apply_ticks: rounding::ceil(self.brake.apply_s * self.rate_hz) as u32,
            },
        }
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
    /// The standing of the axis.
    pub(super) fn commissioning(&self) -> Commissioning {
        let (pid, gains) = (&self.feedback.pid, &self.feedforward.gains);
        let numbers = [
            pid.kp_v_per_mm,
            pid.ki_v_per_mm_s,
            pid.kd_v_s_per_mm,
            gains.inertia_v_s2_per_mm,
            self.amplifier.offset_v,
        ];
        let is_inert = self.feedback.law == LawKind::Pid
            && self.feedforward.kind == FeedforwardKind::None
            && numbers == [0.0; 5];
        match (self.commissioned, is_inert) {
            (true, _) => Commissioning::Done,
            (false, true) => Commissioning::Inert,
            (false, false) => Commissioning::Missing,
        }
    }

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
        let gains = feedback.linear_gains();
        let cancelling = self.cancelling(gains.first());
        let built = AxisBuilder::new(axis, encoder.resolution_mm, period_s)
            .encoder(
                Encoder::new(
                    encoder.counter_bits.into(),
                    encoder.reversed,
                    // One count more: a slow axis still steps by whole counts.
                    (rounding::ceil(largest_step) as i32 + 1).max(LEAST_STEP_COUNTS),
                )
                .with_anchor(self.build_anchor()),
            )
            .output(OutputStage {
                limit_v: amplifier.output_limit_v,
                full_scale_v: amplifier.full_scale_v,
                offset_v: amplifier.offset_v,
                reversed: amplifier.reversed,
            })
            .feedback(feedback.build(period_s))
            .filters(feedback.build_filters(period_s))
            .feedforward(
                feedforward.kind,
                &feedforward.gains,
                &self.friction.over_range(feedforward.range),
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
                // Below it, friction and a load may hold an axis.
                (limits.silent_share * amplifier.output_limit_v)
                    .max(SILENT_FRICTIONS * self.largest_breakaway_v()),
                rounding::round(limits.silent_s / period_s) as u32,
            ))
            .plausibility(self.build_plausibility(period_s))
            .overload(amplifier.build_overload(period_s))
            .oscillation(
                Oscillation::new(
                    feedforward.kind != FeedforwardKind::None,
                    limits.following_error_mm / encoder.resolution_mm,
                    period_s,
                )
                .feeding_from(feedforward.from_mm_s * period_s / encoder.resolution_mm)
                .feeding_beyond(feedforward.from_mm / encoder.resolution_mm),
            )
            .learning(self.build_learning(period_s))
            .cancelling(cancelling.as_ref().map(|(settings, of)| (settings, of)))
            .index_spacing(IndexSpacing::new(
                encoder.counts_per_index,
                encoder.index_tolerance_counts,
            ))
            .travel(limits.build_travel(scale, &stop_ramp))
            .standstill(STANDSTILL_MM_S * period_s / encoder.resolution_mm)
            .reduced_speed(limits.unhomed_mm_s.map(|reduced_mm_s| {
                limits.overspeed_ratio * reduced_mm_s * period_s / encoder.resolution_mm
            }))
            .pulses(self.build_pulses(scale, preview_ticks, longest_preview_ticks - preview_ticks))
            .feedforward_alone(amplifier.feedforward_alone)
            .generator(self.build_generator(
                stop_ramp,
                (longest_preview_ticks - preview_ticks) as u32,
                scale,
            ))
            .commissioning(self.commissioning())
            .try_build();
        debug_assert_eq!(built, Ok(()), "validation accepted what an axis refuses");
    }

    #[inline(never)]
    fn build_plausibility(&self, period_s: f64) -> Plausibility {
        let (limit_v, resolution_mm) = (self.amplifier.output_limit_v, self.encoder.resolution_mm);
        let amplifier = &self.amplifier;
        let per_volt = DacCode::FULL_SCALE / amplifier.full_scale_v;
        let words = OutputScale {
            per_volt: if amplifier.reversed {
                -per_volt
            } else {
                per_volt
            },
            offset: rounding::round(amplifier.offset_v * per_volt) as i32,
        };
        let Some(plant) = self.plant else {
            let breakaway_v = OPEN_SHARE * limit_v;
            return Plausibility::without_model(OPEN_BUDGET_V_S, breakaway_v, words, period_s);
        };
        let breakaway_v = self.largest_breakaway_v();
        // Turned around, an axis goes twice as far along the branch of its virgin curve for twice the force (Masing).
        let seen_mm = HELD_COUNTS * resolution_mm;
        let held_v =
            HELD_ERROR * 2.0 * self.friction.gms.virgin_curve_v(0.5 * seen_mm, breakaway_v);
        let least_load_v = FIRST_LOAD_FRICTIONS * breakaway_v;
        let delay_s = plant.delay_s;
        let gain = plant.gain_mm_per_v_s2;
        let delayed_mm = DELAY_ERROR * gain * limit_v * delay_s * delay_s;
        let breaking_mm = 0.5 * gain * breakaway_v * FRICTION_S * FRICTION_S;
        let least_mm = MODEL_COUNTS * resolution_mm;
        let model = PlausibilityModel {
            gain_mm_per_v_s2: plant.gain_mm_per_v_s2,
            damping_per_s: plant.damping_per_s,
            delay_s,
            limit_v,
            // Beyond it, a step of the encoder is a jump.
            largest_mm_s: 2.0 * self.limits.max_velocity_mm_s,
            held_v: held_v.max(HELD_FRICTIONS * breakaway_v),
            eased_v: EASED_FRICTIONS * breakaway_v,
            regained_v: held_v.min(REGAINED_FRICTIONS * breakaway_v),
            stuck_v: STUCK_FRICTIONS * breakaway_v,
            sliding_v: SLIDING_FRICTIONS * breakaway_v,
            turned_v: TURNED_FRICTIONS * breakaway_v,
            most_turned_v: MOST_TURNED * (TURNED_FRICTIONS * breakaway_v),
            answer_v_per_mm: ANSWER_ERROR * self.largest_gain(|gains| gains.kp_v_per_mm),
            answer_v_s_per_mm: self.largest_gain(|gains| gains.kd_v_s_per_mm),
            turn_mm: TURN_MM.max(TURN_COUNTS * resolution_mm),
            alive_mm: TURN_MM.max(ALIVE_COUNTS * resolution_mm),
            ahead_mm: (AHEAD_MM + delayed_mm).max(least_mm),
            breakaway_v: FRICTION_ERROR * breakaway_v,
            load_v: (LOAD_SHARE * limit_v).max(FIRST_LOAD_SHARE * limit_v + least_load_v),
            first_load_v: (FIRST_LOAD_SHARE * limit_v).max(least_load_v),
            proving_mm: PROVING_MM,
            distance_mm: (MODEL_DISTANCE_MM + delayed_mm.max(breaking_mm)).max(least_mm),
            velocity_mm_s: MODEL_VELOCITY_MM_S.max(MODEL_STEP_COUNTS * resolution_mm / period_s),
        };
        Plausibility::new(&model, words, resolution_mm, period_s)
    }

    /// The larger breakaway of both senses, V. Where the level rises with the speed, a vibration may have hidden some of it at
    /// rest.
    fn largest_breakaway_v(&self) -> f64 {
        let PerDirection { positive, negative } = &self.friction.sliding;
        let level_v = |curve: &StribeckCurve| curve.breakaway_v.max(curve.coulomb_v);
        level_v(&positive.curve).max(level_v(&negative.curve))
    }

    /// The largest gain of a kind that the law may have, the nonlinear one at its largest.
    fn largest_gain(&self, gain: impl Fn(&PidGains) -> f64) -> f64 {
        let gains = self.feedback.linear_gains();
        let linear = gains.iter().map(gain).fold(0.0, f64::max);
        linear * self.feedback.nonlinear.map_or(1.0, |gain| gain.largest())
    }

    #[inline(never)]
    fn build_learning<S: Scalar>(&self, period_s: f64) -> Learning<S> {
        match (&self.feedforward.learning, &self.plant) {
            (Some(settings), Some(plant)) => {
                let gains = self.feedback.linear_gains();
                let axis = LearningLoop {
                    plant,
                    pid: gains.first().unwrap_or(&self.feedback.pid),
                    breakaway_v: self.friction.mean_breakaway_v(),
                    resolution_mm: self.encoder.resolution_mm,
                };
                Learning::build(settings, &axis, period_s)
            }
            _ => Learning::off(),
        }
    }

    /// Cancelling, if the settings have it, and the loop that it is in.
    fn cancelling<'a>(
        &'a self,
        gains: Option<&'a PidGains>,
    ) -> Option<(CancellingSettings, NominalLoop<'a>)> {
        let (settings, plant) = (self.feedforward.cancelling?, self.plant.as_ref()?);
        let feedback = &self.feedback;
        let nonlinear = feedback.nonlinear.filter(|_| feedback.law == LawKind::NPid);
        let of = NominalLoop {
            plant,
            pid: gains.unwrap_or(&feedback.pid),
            friction: &self.friction.gms,
            breakaway_v: self.friction.mean_breakaway_v(),
            filters: feedback.filters.as_deref().unwrap_or_default(),
            largest_gain: nonlinear.map_or(1.0, |gain| gain.largest()),
        };
        Some((settings, of))
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
        .with_stop_limit(limits.stop_ticks(scale.rate_hz))
        .with_reduced_velocity(
            limits
                .unhomed_mm_s
                .map(|reduced_mm_s| Velocity::from_mm_s(reduced_mm_s, scale)),
        )
        .with_wait(wait_ticks)
    }
}

impl AmplifierSettings {
    fn build_overload(&self, period_s: f64) -> Overload {
        let words = |volts: f64| volts * DacCode::FULL_SCALE / self.full_scale_v;
        let (continuous, largest) = (words(self.continuous_v), words(self.output_limit_v));
        let offset = rounding::round(words(self.offset_v)) as i32;
        Overload::new(continuous, largest, self.overload_s, offset, period_s)
    }
}

impl LimitSettings {
    /// The longest that a controlled stop may take: from overspeed, along the braking ramp with the time in which its
    /// deceleration builds up and goes, and a quarter more.
    fn stop_ticks(&self, rate_hz: f64) -> u32 {
        let fastest = self.overspeed_ratio * self.max_velocity_mm_s;
        let building_up_s = 2.0 * self.braking_mm_s2 / self.braking_jerk_mm_s3;
        let longest_s = fastest / self.braking_mm_s2 + building_up_s;
        rounding::ceil(1.25 * longest_s * rate_hz) as u32 + STOP_MARGIN_TICKS
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
        Ok(PerAxis::from_fn(|axis| {
            let index = axis as usize;
            Motion::build(&self.motions[index], stage.motion_scale(index))
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_that_is_fed_forward_over_another_range_leaves_what_the_encoder_is_expected_to_show()
    {
        let axis = StageSettings::simulated().axes[0].clone();
        let mut softer = axis.clone();
        softer.feedforward.range = 2.5;
        assert_eq!(
            softer.build_plausibility(1e-4),
            axis.build_plausibility(1e-4)
        );
        // Softer springs of the friction itself do not.
        softer.friction = softer.friction.over_range(2.5);
        assert_ne!(
            softer.build_plausibility(1e-4),
            axis.build_plausibility(1e-4)
        );
    }
}
