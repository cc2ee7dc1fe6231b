//! One axis, one tick: counts in, a converter's word out.

use crate::control::feedback::{Feedback, FeedbackInput, FeedbackState, FeedbackTerms};
use crate::encoder::{Encoder, EncoderState};
use crate::feedforward::{Feedforward, FeedforwardState, ReferenceStep};
use crate::reference::{Motion, MotionState, ReferenceSample};
use crate::safety::FaultCode;
use crate::scalar::{Quantity, Scalar};
use crate::telemetry::{AxisTelemetry, LimitedBy};
use crate::units::{DacCode, Position};

/// Ticks that the feedforward can look ahead at most: 3 ms at 10 kHz.
pub const MAX_PREVIEW_TICKS: usize = 30;

/// Room for the reference positions from the feedforward's tick back to the one before the feedback's; a power of two.
const PREVIEW_ROOM: usize = MAX_PREVIEW_TICKS + 2;

/// The output stage of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Amplifier<S: Scalar> {
    pub(crate) limit: S,
    pub(crate) codes_per_volt: S::Gain,
    pub(crate) offset_code: i32,
}

impl<S: Scalar> Amplifier<S> {
    #[inline(always)]
    fn code(&self, output: S) -> DacCode {
        DacCode::saturating(
            output
                .round_scaled(self.codes_per_volt)
                .saturating_add(self.offset_code),
        )
    }
}

/// An axis ready for the tick; `N` is the room for GMS elements. Made by
/// [`StageSettings::build`](crate::settings::StageSettings::build).
#[derive(Clone, Debug, PartialEq)]
pub struct Axis<S: Scalar, const N: usize> {
    pub(crate) encoder: Encoder,
    pub(crate) unit_mm: S::Gain,
    /// A displacement in a tick as a velocity.
    pub(crate) unit_mm_s: S::Gain,
    pub(crate) feedback: Feedback<S>,
    pub(crate) feedforward: Feedforward<S, N>,
    pub(crate) preview_ticks: usize,
    /// How long a motion waits, so that the feedback's reference starts when that of every axis does.
    pub(crate) wait_ticks: u32,
    pub(crate) amplifier: Amplifier<S>,
    pub(crate) following_error_limit: S,
    pub(crate) transfer_decay: S,
}

/// The memory of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisState<S: Scalar, const N: usize> {
    encoder: EncoderState,
    motion: MotionState,
    running: bool,
    /// Ticks until the motion begins.
    waiting: u32,
    /// What speaks against the axis in this tick.
    pub(crate) suspect: Option<FaultCode>,
    /// The reference's step at the feedforward's tick.
    step: ReferenceStep<S>,
    /// The reference at the feedforward's tick, ahead of the feedback's.
    ahead: Position,
    preview: [Position; PREVIEW_ROOM],
    /// Velocity of the feedback's reference, for a law that needs it.
    velocity: S,
    feedback: FeedbackState<S>,
    springs: FeedforwardState<S, N>,
    transfer: S,
    last_output: S,
    telemetry: AxisTelemetry<S>,
}

impl<S: Scalar, const N: usize> Default for AxisState<S, N> {
    fn default() -> Self {
        Self {
            encoder: EncoderState::default(),
            motion: MotionState::default(),
            running: false,
            waiting: 0,
            suspect: None,
            step: ReferenceStep::default(),
            ahead: Position::ZERO,
            preview: [Position::ZERO; PREVIEW_ROOM],
            velocity: S::ZERO,
            feedback: FeedbackState::default(),
            springs: FeedforwardState::default(),
            transfer: S::ZERO,
            last_output: S::ZERO,
            telemetry: AxisTelemetry::default(),
        }
    }
}

impl<S: Scalar, const N: usize> AxisState<S, N> {
    /// What the last tick computed.
    pub fn telemetry(&self) -> &AxisTelemetry<S> {
        &self.telemetry
    }

    /// Whether a motion is under way.
    pub fn is_running(&self) -> bool {
        self.running
    }
}

impl<S: Scalar, const N: usize> Axis<S, N> {
    /// Takes the encoder's raw count; says whether it is plausible.
    #[inline(always)]
    pub(crate) fn measure(&self, state: &mut AxisState<S, N>, raw: u32) -> bool {
        let plausible = self.encoder.update(&mut state.encoder, raw);
        state.telemetry.measured = state.encoder.count();
        plausible
    }

    /// Prepares to hold the measured position.
    pub(crate) fn enable(&self, state: &mut AxisState<S, N>) {
        let here = state.encoder.position();
        *state = AxisState {
            encoder: state.encoder.clone(),
            ahead: here,
            preview: [here; PREVIEW_ROOM],
            telemetry: state.telemetry,
            ..AxisState::default()
        };
    }

    /// Starts a motion from where the reference stands.
    #[inline(always)]
    pub(crate) fn run(&self, state: &mut AxisState<S, N>) {
        state.motion = MotionState::start(state.ahead);
        state.running = true;
        state.waiting = self.wait_ticks;
    }

    /// Advances the reference and forms the error; says whether the axis follows. `tick` numbers the ticks.
    #[inline(never)]
    pub(crate) fn refer(&self, state: &mut AxisState<S, N>, motion: &Motion<S>, tick: u32) -> bool {
        let ahead = if state.running && state.waiting == 0 {
            motion.step(&mut state.motion)
        } else {
            ReferenceSample {
                position: state.ahead,
                ..ReferenceSample::default()
            }
        };
        state.waiting = state.waiting.saturating_sub(1);
        state.running = state.running && !motion.finished(&state.motion);
        let displacement = (ahead.position - state.ahead).clipped();
        state.ahead = ahead.position;

        // The feedback's reference is what the feedforward's was `preview_ticks` ago.
        let slot = tick as usize % PREVIEW_ROOM;
        state.preview[slot] = ahead.position;
        let delayed = (tick as usize).wrapping_sub(self.preview_ticks) % PREVIEW_ROOM;
        let reference = state.preview[delayed];
        if self.feedback.needs_velocity() {
            let before = state.preview[delayed.wrapping_sub(1) % PREVIEW_ROOM];
            let displacement = (reference - before).clipped();
            state.velocity = S::scale_integer(displacement, self.unit_mm_s);
        }

        let measured = state.encoder.position();
        let error = S::scale_wide((reference - measured).0, self.unit_mm);
        state.telemetry.reference = reference;
        state.telemetry.error = error;
        state.step = ReferenceStep {
            displacement: S::scale_integer(displacement, self.unit_mm),
            velocity: ahead.velocity,
            acceleration: ahead.acceleration,
        };
        error.magnitude() <= self.following_error_limit
    }

    /// Computes the output. `changed` says that the settings are new in this tick: the output then starts from where
    /// it was, and the difference fades.
    #[inline(never)]
    pub(crate) fn drive(&self, state: &mut AxisState<S, N>, changed: bool) -> DacCode {
        let feedforward = self.feedforward.step(&mut state.springs, state.step);
        let total = feedforward.total();
        let input = FeedbackInput {
            error: state.telemetry.error,
            velocity: state.velocity,
        };
        if changed {
            self.transfer(state, input, total);
        }
        let base = total + state.transfer;
        let feedback = self.feed_back(&mut state.feedback, input, base);
        let limit = self.amplifier.limit;
        let output = (feedback.output + base).limit(-limit, limit);
        state.transfer = state
            .transfer
            .times(self.transfer_decay, Quantity::Fraction);
        state.last_output = output;
        let code = self.amplifier.code(output);
        let telemetry = &mut state.telemetry;
        telemetry.feedback = feedback;
        telemetry.feedforward = feedforward;
        telemetry.transfer = state.transfer;
        telemetry.output = output;
        telemetry.code = code;
        telemetry.limited_by = if feedback.saturated {
            LimitedBy::OutputLimit
        } else {
            LimitedBy::Nothing
        };
        code
    }

    /// The law, within what the output limit leaves beside `base`.
    #[inline(always)]
    fn feed_back(
        &self,
        state: &mut FeedbackState<S>,
        input: FeedbackInput<S>,
        base: S,
    ) -> FeedbackTerms<S> {
        let limit = self.amplifier.limit;
        self.feedback
            .step(state, input, -limit - base, limit - base)
    }

    /// Makes a change of settings bumpless: the output starts from where it was.
    #[cold]
    #[inline(never)]
    fn transfer(&self, state: &mut AxisState<S, N>, input: FeedbackInput<S>, base: S) {
        self.feedback.take_over(&mut state.feedback, input.error);
        // What the new settings would put out, computed on a copy, decides the offset.
        let mut trial = state.feedback.clone();
        let terms = self.feed_back(&mut trial, input, base);
        state.transfer = state.last_output - (terms.output + base);
    }

    /// Shows an axis whose outputs are off.
    #[inline(always)]
    pub(crate) fn rest(&self, state: &mut AxisState<S, N>) {
        let measured = state.encoder.count();
        state.running = false;
        state.last_output = S::ZERO;
        state.telemetry = AxisTelemetry {
            reference: state.encoder.position(),
            measured,
            ..AxisTelemetry::default()
        };
    }
}
