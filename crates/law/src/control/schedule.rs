//! Gain scheduling: a PID whose gains depend on the speed of the reference.
//!
//! Friction makes an axis another one near rest than in motion; a schedule lets the loop be stiffer, or integrate faster,
//! there. Between its points the gains are interpolated linearly, beyond the last they stay. The schedule depends on the
//! reference alone, so at any constant speed the loop is linear, and each point is judged as a PID of its own.
//! Source: Rugh and Shamma, *Research on gain scheduling*, Automatica 36 (2000).

use heapless::Vec;

use super::pid::{Pid, PidGains};
use super::terms::{FeedbackInput, FeedbackState, FeedbackTerms};
use crate::scalar::{Quantity, Scalar};

/// Points of a schedule at most.
pub const MAX_POINTS: usize = 4;

/// The gains at one speed, as shares of the PID's own.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct SchedulePoint {
    /// Speed of the reference, mm/s; zero for the first point, rising from point to point, to 1000.
    pub speed_mm_s: f64,
    /// Share of Kp, 0 to 30.
    pub proportional: f64,
    /// Share of Ki, 0 to 30.
    pub integral: f64,
    /// Share of Kd, 0 to 30.
    pub derivative: f64,
}

impl SchedulePoint {
    /// The gains at this point.
    pub const fn gains(&self, pid: &PidGains) -> PidGains {
        PidGains {
            kp_v_per_mm: pid.kp_v_per_mm * self.proportional,
            ki_v_per_mm_s: pid.ki_v_per_mm_s * self.integral,
            kd_v_s_per_mm: pid.kd_v_s_per_mm * self.derivative,
            derivative_filter_s: pid.derivative_filter_s,
        }
    }

    const fn shares(&self) -> [f64; 3] {
        [self.proportional, self.integral, self.derivative]
    }
}

/// The schedule as a person writes it: one to [`MAX_POINTS`] points.
pub type GainSchedule = Vec<SchedulePoint, MAX_POINTS>;

/// The shares from one speed on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment<S: Scalar> {
    from: S,
    shares: [S; 3],
    slopes: [S::Gain; 3],
}

/// The scheduled PID ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct ScheduledPid<S: Scalar> {
    pub(super) pid: Pid<S>,
    /// Those not used repeat the last.
    segments: [Segment<S>; MAX_POINTS],
}

impl<S: Scalar> ScheduledPid<S> {
    /// Makes the law for a control period from a schedule that has at least one point. Settings time only.
    pub fn build(
        gains: &PidGains,
        schedule: &GainSchedule,
        integral_limit_v: f64,
        period_s: f64,
    ) -> Self {
        const UNSCHEDULED: SchedulePoint = SchedulePoint {
            speed_mm_s: 0.0,
            proportional: 1.0,
            integral: 1.0,
            derivative: 1.0,
        };
        let last = schedule.last().copied().unwrap_or(UNSCHEDULED);
        let segment = |index: usize| {
            let here = schedule.get(index).copied().unwrap_or(last);
            let next = schedule.get(index + 1).copied().unwrap_or(last);
            let run = next.speed_mm_s - here.speed_mm_s;
            let (from, to) = (here.shares(), next.shares());
            Segment {
                from: S::quantise(here.speed_mm_s, Quantity::Velocity),
                shares: from.map(|share| S::quantise(share, Quantity::Multiplier)),
                slopes: core::array::from_fn(|i| {
                    let slope = if run > 0.0 {
                        (to[i] - from[i]) / run
                    } else {
                        0.0
                    };
                    S::gain(slope, Quantity::Velocity, Quantity::Multiplier)
                }),
            }
        };
        Self {
            pid: Pid::build(gains, integral_limit_v, period_s),
            segments: core::array::from_fn(segment),
        }
    }

    /// The shares of Kp, Ki and Kd at a speed of at least zero.
    #[inline(always)]
    fn shares(&self, speed: S) -> [S; 3] {
        let [mut here, rest @ ..] = self.segments;
        for segment in rest {
            if speed >= segment.from {
                here = segment;
            }
        }
        let beyond = speed - here.from;
        core::array::from_fn(|i| here.shares[i] + beyond.scale(here.slopes[i]))
    }

    /// One control period; output and `base` together stay within +-`limit`, all in V.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedbackState<S>,
        input: FeedbackInput<S>,
        base: S,
        limit: S,
    ) -> FeedbackTerms<S> {
        let [kp, ki, kd] = self.shares(input.velocity.magnitude());
        let error = self.pid.derivative.clip(input.error);
        let proportional = error
            .scale(self.pid.proportional)
            .times(kp, Quantity::Multiplier);
        let derivative = self
            .pid
            .derivative
            .step(state, error)
            .times(kd, Quantity::Multiplier);
        let driver = error.times(ki, Quantity::Multiplier);
        self.pid
            .integrator
            .close(state, driver, (proportional, derivative), (base, limit))
    }
}
