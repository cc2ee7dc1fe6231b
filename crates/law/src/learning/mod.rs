//! Learning of the friction feedforward's scale while the axis works.
//!
//! Let `phi` be the friction that the feedforward's models give, V, and `theta` the scale that it is put out with. The nominal
//! closed loop runs beside the axis on `phi`: its position `psi` is, to first order, the error that a unit
//! of `theta` takes away. So
//!
//! - `e0 = e + theta psi` is the error that the axis would have had without feedforward, known at every moment, and
//! - the sum over the past of `(e0 - theta psi)^2` has its least where `theta` is `sum(e0 psi) / sum(psi^2)`.
//!
//! The sums are forgotten exponentially. `theta` goes down the slope of the sum, `sum(e0 psi) - theta sum(psi^2)`, at a limited
//! rate: no division, and it moves the faster the more is known. A much weaker pull leads to the commissioned value, 1. It
//! stays within 0 to [`MOST_SCALE`]; `docs/learning.md` shows why the axis stays bounded with it.
//!
//! **Cut.** Under a vibration the scale also makes up for what the gate takes away, so that there are two of them: what is
//! learnt while the gate is closed holds while it is closed.
//!
//! **Change.** What the last seconds show is compared with all that is remembered. Where their scales differ by more than
//! 10 % while nothing vibrates, the axis has changed, and the rest is forgotten: one reversal then counts for all.
//!
//! **Guard.** The mean squares of `e` and of `e0` over the last seconds are compared. When the error with feedforward is the
//! larger one, the scale falls at a fixed rate towards zero, and what was learnt before is forgotten.

mod closed_loop;
mod vibration;

pub use self::closed_loop::MAX_DELAY_TICKS;
use self::closed_loop::{ClosedLoop, ClosedLoopState};
use self::vibration::{Gate, GateState};
use crate::control::pid::PidGains;
use crate::control::plant_model::PlantModel;
use crate::feedforward::FeedforwardTerms;
use crate::rounding;
use crate::scalar::{Quantity, Scalar};

/// Largest scale.
pub const MOST_SCALE: f64 = 2.5;

/// Learning as a person sets it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct LearningSettings {
    /// Time constant with which the past is forgotten, s.
    pub memory_s: f64,
    /// Amplitude of the vibration's velocity that halves the friction before sliding, mm/s.
    pub vibration_mm_s: f64,
}

impl LearningSettings {
    /// The defaults of the settings.
    pub const DEFAULT: Self = Self {
        memory_s: 7.0,
        vibration_mm_s: 2.0,
    };
}

impl Default for LearningSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The loop that is learnt on. Settings time only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearningLoop<'a> {
    /// The axis' plant.
    pub plant: &'a PlantModel,
    /// The linear part of its PID.
    pub pid: &'a PidGains,
    /// Its mean breakaway level, V.
    pub breakaway_v: f64,
    /// Length of an encoder count, mm.
    pub resolution_mm: f64,
}

/// Bounds of one over the scale: below a quarter, a scale adopts less than it could.
const INVERSES: (f64, f64) = (1.0 / MOST_SCALE, 4.0);

/// Control periods from one look at the axis to the next.
const LOOK_TICKS: u32 = 4;

/// Longest step of the model, s.
const STEP_S: f64 = 1.2e-3;
/// Longest step of the model over the time in which the loop answers.
const STEP_SHARE: f64 = 1.0;
/// Most looks in a step.
const MOST_LOOKS: f64 = 4.0;

/// Length of a block, s, as nearly as whole steps allow: the scale moves once a block.
const BLOCK_S: f64 = 12.8e-3;

/// Unit of errors, as a multiple of breakaway over Kp: half of what a reversal without feedforward leaves.
const ERROR_UNIT: f64 = 4.0;

/// Largest `sum(psi^2)` times time, in units: what was learnt before is halved beyond it.
const MOST_INFORMATION: f64 = 0.07;

/// Least difference of the scale by the last seconds from the present one that shows a change of the axis.
const MIN_CHANGE: f64 = 0.1;
/// Least information of the last seconds that shows a change, as a share of all that is remembered.
const MIN_CHANGE_INFORMATION: f64 = 0.25;

/// Rate of the scale down the slope, 1/s, per unit of information.
const SLOPE_RATE: f64 = 500.0;

/// Time constant of the pull to 1, s.
const PULL_S: f64 = 600.0;

/// Largest change of the scale by learning, 1/s.
const MOST_PER_S: f64 = 0.5;

/// Change of the scale by the guard, 1/s.
const FADE_PER_S: f64 = 1.0;

/// The last seconds, for the guard and for what shows a change: time constant, s.
const GUARD_S: f64 = 2.0;

/// Excess of the error over that without feedforward that the guard allows, as a share of its mean square.
const GUARD_SHARE: f64 = 0.05;
/// The same excess in counts.
const GUARD_COUNTS: f64 = 0.5;

/// Gate below which it is closed.
const CLOSED_GATE: f64 = 0.9;
/// Blocks, half a second, after which an open gate ends a cut.
const QUIET_BLOCKS: u8 = 40;

/// Time for which nothing is learnt after the model and the axis may have parted, s.
const SETTLING_S: f64 = 1.0;

impl LearningLoop<'_> {
    /// Longest step that a model of the loop may take, s: rounding must not take a look away.
    fn step_s(&self) -> f64 {
        let gain = self.plant.gain_mm_per_v_s2;
        let crossover_per_s = (gain * self.pid.kd_v_s_per_mm)
            .max(libm::sqrt(gain * self.pid.kp_v_per_mm))
            .max(1e-9);
        1.001 * f64::min(STEP_S, STEP_SHARE / crossover_per_s)
    }
}

/// The reason for which the scale is not learnt in a tick, or that it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum LearningStatus {
    /// The settings have no learning.
    #[default]
    Off,
    /// Nothing: the scale is learnt.
    Learning,
    /// The reference stands.
    AtRest,
    /// The motion is none of the work's: a jog, homing, a controlled stop, an injection.
    OtherMotion,
    /// The output is at its limit.
    Saturated,
    /// The settings were exchanged, or the output was at its limit, a moment ago.
    Settling,
    /// The axis errs more than it would without feedforward: the scale is faded out.
    Fading,
}

/// Learning ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Learning<S: Scalar> {
    /// Looks in a step; none without learning.
    looks: u8,
    /// Steps in a block.
    block_steps: u8,
    settling_steps: u16,
    closed_loop: ClosedLoop<S>,
    gate: Gate<S>,
    /// Share of a change of the feedforward that the integral loses: none without an integral, which would never get it back.
    unloaded: S::Gain,
    /// An error in units.
    per_unit: S::Gain,
    one: S,
    most: S,
    inverses: (S, S),
    estimate: Estimate<S>,
}

/// The sums and what moves the scale, ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
struct Estimate<S: Scalar> {
    /// Length of a step, s.
    step: S::Gain,
    half: S::Gain,
    /// Share that a block keeps of the sums that are learnt from, and of the guard's.
    keep: S,
    guard_keep: S,
    most_information: S,
    rate: S::Gain,
    pull: S::Gain,
    most_change: S,
    fade: S,
    guard_share: S::Gain,
    guard_least: S,
    differs: S::Gain,
    change_information: S::Gain,
    /// The gate less 1 below which the axis is shaken.
    shaken: S,
}

/// The memory of learning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LearningState<S: Scalar> {
    /// The scale that the friction feedforward is put out with, less 1.
    deviation: S,
    /// One over the scale, less 1; it follows in some blocks, and stays within [`INVERSES`].
    inverse: S,
    /// The friction that the models gave in the last tick, and of it what the gate acts on, before the gate, V.
    friction: S,
    presliding: S,
    closed_loop: ClosedLoopState<S>,
    gate: GateState<S>,
    status: LearningStatus,
    /// The output was at its limit since the last step.
    saturated: bool,
    /// Looks in the step, steps in the block, and steps until learning begins again.
    looks: u8,
    steps: u8,
    settling: u16,
    /// True if the gate is closed; blocks for which it has been closed or open; and what was learnt while it was the other.
    shaken: bool,
    lasting: u8,
    other: Learnt<S>,
    /// Sums of the block, and the forgetting ones.
    block: Sums<S>,
    sums: Sums<S>,
    /// The sums of the last seconds alone.
    lately: Fit<S>,
}

/// What was learnt in one state of the gate: the scale less 1, and the sums that it was learnt from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Learnt<S> {
    deviation: S,
    fit: Fit<S>,
}

/// The sums whose quotient is the scale of least error, in units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Fit<S> {
    /// `psi^2`.
    information: S,
    /// `e0 psi`.
    correlation: S,
}

/// Sums of products, in units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums<S> {
    fit: Fit<S>,
    /// `e^2`.
    with: S,
    /// `e0^2`.
    without: S,
}

/// The result of learning at a tick, as the slow half takes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LearningReading<S> {
    /// The scale of the friction feedforward less 1, a [`Quantity::Multiplier`].
    pub deviation: S,
    /// The gate less 1, a [`Quantity::Multiplier`]: 0 while nothing vibrates.
    pub gate: S,
    /// Sums of the squares of the error, and of the error without feedforward, in learning's own unit.
    pub squares: [S; 2],
    /// The reason for which the scale is not learnt, or that it is.
    pub status: LearningStatus,
}

impl<S: Scalar> LearningReading<S> {
    /// The scale of the friction feedforward; 1 is the commissioned one.
    pub fn scale(&self) -> f32 {
        1.0 + self.deviation.to_f32(Quantity::Multiplier)
    }

    /// The share of the friction before sliding that the vibration leaves, 0 to 1.
    pub fn gate(&self) -> f32 {
        1.0 + self.gate.to_f32(Quantity::Multiplier)
    }

    /// RMS error over that without feedforward, over the guard's window; none before the axis has moved.
    pub fn error_share(&self) -> Option<f32> {
        let [with, without] = self.squares.map(|sum| sum.to_f32(Quantity::Multiplier));
        (without > 0.0).then(|| libm::sqrtf(with / without))
    }
}

/// The axis as a step of learning sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearningInput<S> {
    /// Tracking error, mm.
    pub error: S,
    /// The reason for which the axis cannot learn at present; [`LearningStatus::Learning`] for none.
    pub status: LearningStatus,
}

impl<S: Scalar> Learning<S> {
    /// Learning on an axis, for a control period. Settings time only.
    pub fn build(settings: &LearningSettings, axis: &LearningLoop, period_s: f64) -> Self {
        let look_s = period_s * f64::from(LOOK_TICKS);
        let looks = rounding::floor(axis.step_s() / look_s).clamp(1.0, MOST_LOOKS);
        let step_s = look_s * looks;
        let block_steps = rounding::round(BLOCK_S / step_s).clamp(1.0, f64::from(u8::MAX));
        let block_s = step_s * block_steps;
        let unit_mm = ERROR_UNIT * axis.breakaway_v / axis.pid.kp_v_per_mm.max(1e-9);
        let count = GUARD_COUNTS * axis.resolution_mm / unit_mm;
        let number = |value| S::quantise(value, Quantity::Multiplier);
        let share = |value| S::gain(value, Quantity::Multiplier, Quantity::Multiplier);
        let fraction = |value| S::quantise(value, Quantity::Fraction);
        Self {
            looks: looks as u8,
            block_steps: block_steps as u8,
            settling_steps: (SETTLING_S / step_s).min(f64::from(u16::MAX)) as u16,
            closed_loop: ClosedLoop::build(axis.plant, axis.pid, period_s, step_s),
            gate: Gate::build(
                settings.vibration_mm_s,
                axis.resolution_mm,
                step_s,
                looks as u8,
            ),
            unloaded: S::gain(
                if axis.pid.ki_v_per_mm_s > 0.0 {
                    1.0
                } else {
                    0.0
                },
                Quantity::Voltage,
                Quantity::Voltage,
            ),
            per_unit: S::gain(1.0 / unit_mm, Quantity::Length, Quantity::Multiplier),
            one: number(1.0),
            most: number(MOST_SCALE),
            inverses: (number(INVERSES.0), number(INVERSES.1)),
            estimate: Estimate {
                step: share(step_s),
                half: share(0.5),
                keep: fraction(libm::exp(-block_s / settings.memory_s)),
                guard_keep: fraction(libm::exp(-block_s / GUARD_S)),
                most_information: number(MOST_INFORMATION),
                rate: share(SLOPE_RATE * block_s),
                pull: share(1.0 / (SLOPE_RATE * PULL_S)),
                most_change: number(MOST_PER_S * block_s),
                fade: number(FADE_PER_S * block_s),
                guard_share: share(GUARD_SHARE),
                differs: share(MIN_CHANGE),
                change_information: share(MIN_CHANGE_INFORMATION),
                guard_least: number(GUARD_S * count * count),
                shaken: number(CLOSED_GATE - 1.0),
            },
        }
    }

    /// No learning: the feedforward is put out as it is.
    pub fn off() -> Self {
        Self::default()
    }

    /// True if there is learning.
    pub const fn is_on(&self) -> bool {
        self.looks > 0
    }

    /// A memory that begins at the commissioned value. Nothing is learnt from what the axis did before.
    pub(crate) fn start(&self) -> LearningState<S> {
        LearningState {
            settling: self.settling_steps,
            status: LearningStatus::Settling,
            ..LearningState::default()
        }
    }

    /// Goes on with what was learnt on an axis that is enabled: it is at rest, and so is the model.
    pub(crate) fn resume(&self, state: &mut LearningState<S>) {
        let LearningState {
            deviation: _,
            inverse: _,
            sums: _,
            shaken: _,
            lasting: _,
            other: _,
            status: _,
            friction,
            presliding,
            closed_loop,
            gate,
            saturated,
            looks,
            steps,
            settling,
            block,
            lately,
        } = state;
        *friction = S::ZERO;
        *presliding = S::ZERO;
        *closed_loop = ClosedLoopState::default();
        *gate = GateState::default();
        *saturated = false;
        *looks = 0;
        *steps = 0;
        *settling = 0;
        *block = Sums::default();
        *lately = Fit::default();
    }

    /// Learns nothing for a while: what the axis does now is not what the model does.
    pub(crate) fn unsettle(&self, state: &mut LearningState<S>) {
        state.settling = self.settling_steps;
    }

    /// A voltage over the scale, V: what the friction has to grow by, so that the output grows by as much.
    pub(crate) fn unscaled(&self, state: &LearningState<S>, voltage: S) -> S {
        voltage.times(self.one + state.inverse, Quantity::Multiplier)
    }

    /// Takes note that the friction takes a voltage over from the integral, V; returns by how much the output grows, V.
    pub(crate) fn take_over(&self, state: &mut LearningState<S>, friction: S) -> S {
        let gate = self.one + state.gate.deviation();
        let gated = friction.times(gate, Quantity::Multiplier);
        ClosedLoop::hold_against(&mut state.closed_loop, gated.scale(self.unloaded));
        gated.times(self.scale(state), Quantity::Multiplier)
    }

    /// Passes the friction of this tick through the gate, and scales it.
    #[inline(always)]
    pub(crate) fn apply(&self, state: &mut LearningState<S>, terms: &mut FeedforwardTerms<S>) {
        state.presliding = terms.level + terms.presliding;
        terms.gate_friction(self.one + state.gate.deviation());
        state.friction = terms.friction();
        terms.scale_friction(self.scale(state));
    }

    /// The scale of the friction feedforward, a [`Quantity::Multiplier`].
    fn scale(&self, state: &LearningState<S>) -> S {
        self.one + state.deviation
    }

    /// Looks at the tracking error, mm; returns true if a step is due.
    #[inline(always)]
    pub(crate) fn look(&self, state: &mut LearningState<S>, error: S) -> bool {
        state.gate.add_error(error);
        state.looks += 1;
        let due = state.looks >= self.looks;
        if due {
            state.looks = 0;
        }
        due
    }

    /// One step; returns the voltage by which the feedforward grew with a change of
    /// the scale, which the integral is to lose: what it has taken up of the friction is the feedforward's now. `gain` is the nonlinear gain of
    /// the feedback at an error, if it has one.
    #[inline(always)]
    pub(crate) fn step(
        &self,
        state: &mut LearningState<S>,
        input: LearningInput<S>,
        gain: impl FnOnce(S) -> Option<S>,
    ) -> S {
        let error = input.error;
        let opened = self.gate.step(&mut state.gate);
        let ungated = state
            .presliding
            .times(opened, Quantity::Multiplier)
            .scale(self.unloaded);
        ClosedLoop::hold_against(&mut state.closed_loop, ungated);
        let mut without = error;
        let scale = self.scale(state);
        let gained = ungated.times(scale, Quantity::Multiplier);
        let missing = self
            .closed_loop
            .step(&mut state.closed_loop, state.friction, |missing| {
                without = error + missing.times(scale, Quantity::Multiplier);
                // Between the two errors, the gain at the larger one counts for most of the way.
                let (with, without) = (error.magnitude(), without.magnitude());
                gain(if with > without { with } else { without }).unwrap_or(self.one)
            });
        let mut status = input.status;
        if core::mem::take(&mut state.saturated) {
            state.settling = self.settling_steps;
            status = LearningStatus::Saturated;
        }
        if let Some(left) = state.settling.checked_sub(1) {
            state.settling = left;
            if status == LearningStatus::Learning {
                status = LearningStatus::Settling;
            }
        }
        if status != LearningStatus::Learning {
            state.status = status;
            return gained;
        }
        let unit = |length: S| length.scale(self.per_unit).within(self.one);
        let (psi, with, without) = (unit(missing), unit(error), unit(without));
        let product = |one: S, other: S| one.times(other, Quantity::Multiplier);
        let block = &mut state.block;
        let fit = &mut block.fit;
        fit.information = fit.information + product(psi, psi);
        fit.correlation = fit.correlation + product(without, psi);
        block.with = block.with + product(with, with);
        block.without = block.without + product(without, without);
        state.steps += 1;
        if state.steps < self.block_steps {
            return gained;
        }
        let before = state.deviation;
        self.end_block(state);
        let change = state.deviation - before;
        // What a unit of the scale would have taken from the integral by now.
        let integral = ClosedLoop::integral(&state.closed_loop);
        gained + integral.times(change, Quantity::Multiplier)
    }

    /// Takes up what was learnt with the gate as it is now: closed, the scale makes up for what the gate takes away. When it
    /// opens, the scale is at most what it was before. When it closes again soon, it is what it was then.
    #[inline(always)]
    fn follow_gate(&self, state: &mut LearningState<S>) {
        let shaken = state.gate.deviation() < self.estimate.shaken;
        if shaken == state.shaken {
            state.lasting = state.lasting.saturating_add(1);
            return;
        }
        let now = Learnt {
            deviation: state.deviation,
            fit: state.sums.fit,
        };
        state.lately = Fit::default();
        let before = core::mem::replace(&mut state.other, now);
        if !shaken || state.lasting < QUIET_BLOCKS {
            let falls = !shaken && now.deviation < before.deviation;
            state.deviation = if falls { now } else { before }.deviation;
            state.sums.fit = before.fit;
        }
        state.shaken = shaken;
        state.lasting = 0;
    }

    /// One step of Newton's towards one over the scale.
    #[inline(always)]
    fn follow_scale(&self, state: &mut LearningState<S>) {
        let inverse = self.one + state.inverse;
        let product = inverse.times(self.scale(state), Quantity::Multiplier);
        let next = inverse + inverse.times(self.one - product, Quantity::Multiplier);
        let (least, most) = self.inverses;
        state.inverse = next.limit(least, most) - self.one;
    }

    /// Takes a block into the sums, and moves the scale.
    #[inline(never)]
    fn end_block(&self, state: &mut LearningState<S>) {
        let estimate = &self.estimate;
        let block = core::mem::take(&mut state.block);
        state.steps = 0;
        self.follow_gate(state);
        let scale = self.scale(state);
        let sums = &mut state.sums;
        let add = |sum: S, keep: S, block: S| {
            sum.times(keep, Quantity::Fraction) + block.scale(estimate.step)
        };
        sums.with = add(sums.with, estimate.guard_keep, block.with);
        sums.without = add(sums.without, estimate.guard_keep, block.without);
        let allowed = sums.without + sums.without.scale(estimate.guard_share);
        let worse = sums.with > allowed + estimate.guard_least;
        let keep = if worse {
            estimate.guard_keep
        } else {
            estimate.keep
        };
        let add_fit = |fit: Fit<S>, keep: S| Fit {
            information: add(fit.information, keep, block.fit.information),
            correlation: add(fit.correlation, keep, block.fit.correlation),
        };
        let lately = add_fit(state.lately, estimate.guard_keep);
        state.lately = lately;
        let fit = &mut sums.fit;
        *fit = add_fit(*fit, keep);
        let informed = lately.information > fit.information.scale(estimate.change_information);
        let differs = lately.slope(scale).magnitude() > lately.information.scale(estimate.differs);
        if informed & differs & !state.shaken {
            *fit = lately;
        }
        if fit.information > estimate.most_information {
            fit.information = fit.information.scale(estimate.half);
            fit.correlation = fit.correlation.scale(estimate.half);
        }
        let change = if worse {
            state.status = LearningStatus::Fading;
            -estimate.fade
        } else {
            state.status = LearningStatus::Learning;
            let slope = fit.slope(scale) - state.deviation.scale(estimate.pull);
            slope.scale(estimate.rate).within(estimate.most_change)
        };
        state.deviation = (scale + change).limit(S::ZERO, self.most) - self.one;
        self.follow_scale(state);
    }
}

impl<S: Scalar> Fit<S> {
    /// The slope of the sum of squares towards a larger scale; zero at the scale of least error.
    fn slope(self, scale: S) -> S {
        self.correlation - self.information.times(scale, Quantity::Multiplier)
    }
}

impl<S: Scalar> LearningState<S> {
    /// The scale of the friction feedforward; 1 is the commissioned one. For telemetry.
    pub fn scale(&self) -> f32 {
        1.0 + self.deviation.to_f32(Quantity::Multiplier)
    }

    /// The reason for which the scale is not learnt, or that it is.
    pub const fn status(&self) -> LearningStatus {
        self.status
    }

    /// All of it at once, for a person.
    #[inline(always)]
    pub fn reading(&self) -> LearningReading<S> {
        LearningReading {
            deviation: self.deviation,
            gate: self.gate.deviation(),
            squares: [self.sums.with, self.sums.without],
            status: self.status,
        }
    }

    /// Takes note that the output is at its limit.
    pub(crate) fn saturate(&mut self) {
        self.saturated = true;
    }

    /// The share of the friction before sliding that the vibration leaves, 0 to 1. For telemetry.
    pub fn gate(&self) -> f32 {
        1.0 + self.gate.deviation().to_f32(Quantity::Multiplier)
    }

    /// Sum of the error's squares, the last seconds counting, in learning's own unit. For telemetry.
    pub fn error_squares(&self) -> f32 {
        self.sums.with.to_f32(Quantity::Multiplier)
    }

    /// The same of the error that there would be without feedforward.
    pub fn error_squares_off(&self) -> f32 {
        self.sums.without.to_f32(Quantity::Multiplier)
    }
}
