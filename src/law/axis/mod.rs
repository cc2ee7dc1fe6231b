//! One axis, one tick: counts in, a converter's word out.

mod injected;
mod state;

pub use state::AxisState;

use crate::law::control::feedback::{Feedback, FeedbackInput, FeedbackState, FeedbackTerms};
use crate::law::control::pid::Pid;
pub use crate::law::course::CourseMode;
use crate::law::course::{Course, CourseEvent};
use crate::law::encoder::{Encoder, EncoderReading};
use crate::law::feedforward::{Feedforward, FeedforwardTerms, ReferenceStep};
use crate::law::homing::HomingInput;
use crate::law::reference::Motion;
use crate::law::safety::monitor::{Following, IndexSpacing, Overspeed, Silence};
use crate::law::safety::travel::{Travel, TravelState};
use crate::law::safety::{AxisSwitches, Command, FaultCode};
use crate::law::scalar::{Quantity, Scalar};
use crate::law::telemetry::{AxisTelemetry, LimitedBy};
use crate::law::units::{DacCode, Position};

/// Ticks that the feedforward can look ahead at most: 3 ms at 10 kHz.
pub const MAX_PREVIEW_TICKS: usize = 30;

/// Room for the reference positions from the feedforward's tick back to the one before the feedback's; a power of two.
const PREVIEW_ROOM: usize = MAX_PREVIEW_TICKS + 2;

/// The output stage of an axis.
#[derive(Clone, Debug, Default, PartialEq)]
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
    pub(crate) amplifier: Amplifier<S>,
    pub(crate) transfer_decay: S,
    pub(crate) overspeed: Overspeed,
    pub(crate) silence: Silence<S>,
    pub(crate) index: IndexSpacing,
    pub(crate) following: Following<S>,
    pub(crate) travel: Travel,
    pub(crate) course: Course<S>,
}

impl<S: Scalar, const N: usize> Axis<S, N> {
    /// An axis that puts out nothing: room for one that is
    /// [built in its place](crate::settings::StageSettings::build_axis_into).
    #[inline(never)]
    pub fn blank() -> Self {
        Self {
            encoder: Encoder::default(),
            unit_mm: S::Gain::default(),
            unit_mm_s: S::Gain::default(),
            feedback: Feedback::Pid(Pid::default()),
            feedforward: Feedforward::blank(),
            preview_ticks: 0,
            amplifier: Amplifier::default(),
            transfer_decay: S::ZERO,
            overspeed: Overspeed::default(),
            silence: Silence::default(),
            index: IndexSpacing::default(),
            following: Following::default(),
            travel: Travel::UNLIMITED,
            course: Course::default(),
        }
    }

    /// Takes the encoder's reading; says whether there is nothing to suspect. What there is stays in `state.suspect`.
    #[inline(always)]
    pub(crate) fn measure(&self, state: &mut AxisState<S, N>, reading: &EncoderReading) -> bool {
        let step = self.encoder.update(&mut state.encoder, reading.count);
        state.telemetry.measured = state.encoder.count();
        let slow = self.overspeed.step(&mut state.overspeed, step.counts);
        let audible = self
            .silence
            .step(&mut state.silence, step.counts, state.last_output);
        let indexed = match reading.index {
            Some(raw) => {
                let at = self.encoder.count_at(&state.encoder, raw);
                state.pulse = Some(at.position());
                self.index.step(&mut state.index, at.0 as u32)
            }
            None => true,
        };
        let sound = reading.fresh & reading.valid & step.plausible & slow & audible & indexed;
        if !sound {
            // Where counts may be lost, so is the origin.
            if !reading.valid | !step.plausible | !indexed {
                state.homed = false;
            }
            // The first that explains the others.
            state.suspect = Some(if !reading.fresh {
                FaultCode::StaleSample
            } else if !reading.valid {
                FaultCode::EncoderInvalid
            } else if !step.plausible {
                FaultCode::EncoderJump
            } else if !indexed {
                FaultCode::IndexMismatch
            } else if !slow {
                FaultCode::Overspeed
            } else {
                FaultCode::EncoderSilent
            });
        }
        sound
    }

    /// Prepares to hold the measured position.
    pub(crate) fn enable(&self, state: &mut AxisState<S, N>) {
        let here = state.encoder.position();
        *state = AxisState {
            encoder: state.encoder.clone(),
            homed: state.homed,
            index: state.index,
            following: self.following.start(),
            ahead: here,
            preview: [here; PREVIEW_ROOM],
            telemetry: state.telemetry,
            ..AxisState::default()
        };
    }

    /// Starts or ends a motion, from where the reference stands. What the axis cannot follow now is ignored.
    pub(crate) fn obey(&self, state: &mut AxisState<S, N>, command: Command) {
        let (course, here) = (&mut state.course, state.ahead);
        match command {
            Command::Run | Command::StartMove(_) => self.course.run(course, here),
            Command::Jog(_, velocity) => self.course.jog(course, here, velocity),
            Command::StartStream => self.course.run_stream(course),
            // Begins with the stage, not with an axis.
            Command::StartInjection => {}
            Command::Stop => self.stop(state),
            Command::Home(_) => {
                if self.course.home(course, here) {
                    state.homed = false;
                    state.pulse = None;
                }
            }
            Command::Enable | Command::Disable | Command::ResetFault => {}
        }
    }

    /// Brakes what is under way, unless it brakes already.
    pub(crate) fn stop(&self, state: &mut AxisState<S, N>) {
        let from = state.standing();
        self.course.stop(&mut state.course, from);
    }

    /// Shifts every position of the axis: nothing moves by it.
    #[cold]
    #[inline(never)]
    fn shift(state: &mut AxisState<S, N>, offset: Position) {
        state.encoder.shift(offset);
        state.telemetry.measured = state.encoder.count();
        state.ahead = state.ahead + offset;
        for position in &mut state.preview {
            *position = *position + offset;
        }
        // Distances to pulses before the shift would be off by it.
        IndexSpacing::forget(&mut state.index);
        state.travel = TravelState::default();
        state.homed = true;
    }

    /// Whether the reference goes where it may.
    #[inline(always)]
    fn confine(&self, state: &mut AxisState<S, N>, switches: AxisSwitches) -> bool {
        let found = if switches.at_limit() && !self.course.expects(&state.course, switches) {
            // Away from a pressed switch the axis may go.
            let forward = state.displacement > Position::ZERO;
            let backward = state.displacement < Position::ZERO;
            if forward && switches.has(AxisSwitches::POSITIVE_LIMIT) {
                Some(FaultCode::PositiveLimitSwitch)
            } else if backward && switches.has(AxisSwitches::NEGATIVE_LIMIT) {
                Some(FaultCode::NegativeLimitSwitch)
            } else {
                None
            }
        } else {
            None
        };
        let found = match found {
            None if state.homed => self.travel.step(
                &mut state.travel,
                &self.course.braking,
                state.ahead,
                state.displacement,
                state.encoder.position(),
            ),
            found => found,
        };
        if found.is_some() {
            state.suspect = found;
        }
        found.is_none()
    }

    /// Advances the reference and forms the error; says whether the axis follows and stays where it may. What there is to
    /// suspect stays in `state.suspect`. `tick` numbers the ticks.
    #[inline(never)]
    pub(crate) fn refer(
        &self,
        state: &mut AxisState<S, N>,
        motion: &Motion<S>,
        switches: AxisSwitches,
        tick: u32,
    ) -> bool {
        let input = HomingInput {
            switches,
            index: state.pulse.take(),
            measured: state.encoder.position(),
        };
        let from = state.standing();
        let (ahead, event) =
            self.course
                .advance(&mut state.course, motion, from, state.homed, input);
        if event == CourseEvent::Open {
            return self.refer_open(state, switches, tick);
        }
        if let CourseEvent::Origin(offset) = event {
            Self::shift(state, offset);
        }
        state.displacement_before = state.displacement;
        state.displacement = ahead.position - state.ahead;
        let displacement = state.displacement.clipped();
        state.ahead = ahead.position;
        let mut confined =
            state.course.mode() == CourseMode::Stopping || self.confine(state, switches);
        if let CourseEvent::Fault(code) = event {
            state.suspect = Some(code);
            confined = false;
        }

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
        state.telemetry.velocity = ahead.velocity;
        state.step = ReferenceStep {
            displacement: S::scale_integer(displacement, self.unit_mm),
            velocity: ahead.velocity,
            acceleration: ahead.acceleration,
        };
        let follows = self
            .following
            .step(&mut state.following, error, ahead.velocity.magnitude());
        if !follows {
            // It cannot be braked under control, so it goes before what could.
            state.suspect = Some(FaultCode::FollowingError);
        }
        follows & confined
    }

    /// Computes the output. `changed` says that the settings are new in this tick: the output then starts from where
    /// it was, and the difference fades.
    #[inline(never)]
    pub(crate) fn drive(&self, state: &mut AxisState<S, N>, changed: bool) -> DacCode {
        if state.mode() == CourseMode::OpenLoop {
            return self.drive_open(state);
        }
        let feedforward = self.feedforward.step(&mut state.springs, state.step);
        let total = feedforward.total();
        let input = FeedbackInput {
            error: state.telemetry.error,
            velocity: state.velocity,
        };
        if changed {
            self.transfer(state, input, total + state.injected);
        }
        let base = total + state.transfer + state.injected;
        let feedback = self.feed_back(&mut state.feedback, input, base);
        let limit = self.amplifier.limit;
        let output = (feedback.output + base).limit(-limit, limit);
        state.transfer = state
            .transfer
            .times(self.transfer_decay, Quantity::Fraction);
        self.put_out(state, feedback, feedforward, output)
    }

    /// Makes a converter's word of the output, and leaves everything to be seen.
    #[inline(always)]
    fn put_out(
        &self,
        state: &mut AxisState<S, N>,
        feedback: FeedbackTerms<S>,
        feedforward: FeedforwardTerms<S>,
        output: S,
    ) -> DacCode {
        state.last_output = output;
        let code = self.amplifier.code(output);
        let telemetry = &mut state.telemetry;
        telemetry.feedback = feedback;
        telemetry.feedforward = feedforward;
        telemetry.transfer = state.transfer;
        telemetry.output = output;
        telemetry.code = code;
        telemetry.code_sum = telemetry.code_sum.wrapping_add(code.0.into());
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
        state.course.hold();
        state.injected = S::ZERO;
        state.last_output = S::ZERO;
        state.telemetry = AxisTelemetry {
            reference: state.encoder.position(),
            measured,
            code_sum: state.telemetry.code_sum,
            ..AxisTelemetry::default()
        };
    }
}
