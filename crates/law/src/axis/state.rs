//! The memory of an axis.

use super::PREVIEW_ROOM;
use super::fading::FadingState;
use super::rest::RestState;
use super::telemetry::AxisTelemetry;
use crate::cancelling::{CancellingState, SpindleSpeed};
use crate::control::filter::FiltersState;
use crate::control::terms::FeedbackState;
use crate::encoder::EncoderState;
use crate::feedforward::FeedforwardState;
use crate::friction::gms::FIRMWARE_ELEMENTS;
use crate::learning::LearningState;
use crate::motion::{GeneratorState, MotionMode, ReferenceState};
use crate::reference::{ReferenceSample, Segment};
use crate::safety::monitor::{FollowingState, IndexState, OverspeedState, SignalLossState};
use crate::safety::oscillation::{OscillationReading, OscillationState};
use crate::safety::overload::OverloadState;
use crate::safety::plausibility::{PlausibilityState, Shown};
use crate::safety::travel::TravelState;
use crate::scalar::Scalar;
use crate::units::Position;

/// The memory of an axis. What every tick reads and writes comes first.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct AxisState<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    pub(super) encoder: EncoderState,
    pub(super) overspeed: OverspeedState,
    pub(super) signal_loss: SignalLossState,
    /// The travel is in force.
    pub(super) homed: bool,
    pub(super) travel: TravelState,
    pub(super) telemetry: AxisTelemetry<S>,
    /// The displacement of the reference at the feedforward's tick, and in the tick before.
    pub(super) displacement: Position,
    pub(super) displacement_before: Position,
    /// The reference at the feedforward's tick, ahead of the feedback's.
    pub(super) look_ahead: Position,
    pub(super) following: FollowingState<S>,
    /// The acceleration of the reference at the feedforward's tick, mm/s^2.
    pub(super) acceleration: S,
    /// The velocity of the feedback's reference, mm/s, for a law that needs it.
    pub(super) reference_velocity: S,
    /// Voltage that a host adds to the output in this tick, V.
    pub(super) injected: S,
    pub(super) feedback: FeedbackState<S>,
    pub(super) rest: RestState<S>,
    pub(super) fading: FadingState<S>,
    pub(super) filters: FiltersState<S>,
    pub(super) friction: FeedforwardState<S, N>,
    pub(super) generator: GeneratorState<S>,
    pub(super) plausibility: PlausibilityState,
    pub(super) overload: OverloadState,
    pub(super) oscillation: OscillationState,
    pub(super) preview: [Position; PREVIEW_ROOM],
    /// Position of the axis at the last index pulse, until homing takes it.
    pub(super) pulse: Option<Position>,
    pub(super) index: IndexState,
    pub(super) learning: LearningState<S>,
    pub(super) cancelling: CancellingState<S>,
    /// Ticks of an axis that is driven by itself.
    pub(super) ticks: u32,
}

impl<S: Scalar, const N: usize> Default for AxisState<S, N> {
    fn default() -> Self {
        Self {
            ticks: 0,
            encoder: EncoderState::default(),
            generator: GeneratorState::default(),
            pulse: None,
            homed: false,
            overspeed: OverspeedState::default(),
            signal_loss: SignalLossState::default(),
            plausibility: PlausibilityState::default(),
            overload: OverloadState::default(),
            oscillation: OscillationState::default(),
            index: IndexState::default(),
            following: FollowingState::default(),
            travel: TravelState::default(),
            displacement: Position::ZERO,
            displacement_before: Position::ZERO,
            acceleration: S::ZERO,
            look_ahead: Position::ZERO,
            preview: [Position::ZERO; PREVIEW_ROOM],
            reference_velocity: S::ZERO,
            feedback: FeedbackState::default(),
            rest: RestState::default(),
            fading: FadingState::default(),
            filters: FiltersState::default(),
            friction: FeedforwardState::default(),
            injected: S::ZERO,
            telemetry: AxisTelemetry::default(),
            learning: LearningState::default(),
            cancelling: CancellingState::default(),
        }
    }
}

impl<S: Scalar, const N: usize> AxisState<S, N> {
    /// The number of this tick of an axis that is driven by itself.
    pub(super) fn count_tick(&mut self) -> u32 {
        let tick = self.ticks;
        self.ticks = tick.wrapping_add(1);
        tick
    }

    /// Every term of the law at the last tick.
    pub fn telemetry(&self) -> &AxisTelemetry<S> {
        &self.telemetry
    }

    /// The memory of learning: the friction's scale.
    pub fn learning(&self) -> &LearningState<S> {
        &self.learning
    }

    /// The memory of cancelling: the voltage that it adds.
    pub fn cancelling(&self) -> &CancellingState<S> {
        &self.cancelling
    }

    /// The oscillation that was found last.
    pub fn oscillation(&self) -> OscillationReading {
        self.oscillation.reading()
    }

    /// Sets the speed of the spindle.
    pub(crate) fn set_spindle_speed(&mut self, speed: SpindleSpeed) {
        self.cancelling.set_speed(speed);
    }

    /// True while a motion is under way.
    pub fn is_running(&self) -> bool {
        self.mode() != MotionMode::Hold
    }

    /// The present motion mode.
    pub fn mode(&self) -> MotionMode {
        self.generator.mode()
    }

    /// Voltage that a host adds to the output, V.
    pub fn injected(&self) -> S {
        self.injected
    }

    /// Measured position, 2^-16 counts.
    pub(crate) fn measured(&self) -> Position {
        self.encoder.position()
    }

    /// Measured and filtered speed, 2^-8 counts per tick.
    pub(crate) fn speed(&self) -> i32 {
        self.overspeed.speed()
    }

    /// The axis' motion and output as it shows them.
    #[inline(always)]
    pub(super) fn shown(&self) -> Shown {
        Shown {
            count: self.encoder.count().0 as i32,
            speed: self.speed(),
            words: self.telemetry.code_sum,
            reference: Shown::reference(self.telemetry.reference),
            open: self.mode() == MotionMode::OpenLoop,
            excited: self.injected != S::ZERO,
        }
    }

    /// Sets what is added to the output from this tick on, V.
    pub(crate) fn inject(&mut self, voltage: S) {
        self.injected = voltage;
    }

    /// Position of the look-ahead reference: that of the feedback follows by the preview.
    pub fn reference(&self) -> Position {
        self.look_ahead
    }

    /// True if there is room for a segment of a stream.
    pub fn wants_segment(&self) -> bool {
        self.generator.stream.wants_segment()
    }

    /// Gives the axis the next segment of a stream; call it when [`AxisState::wants_segment`]. What is left of a stream
    /// that was broken off is dropped.
    pub(crate) fn offer_segment(&mut self, segment: &Segment) {
        self.generator.stream.offer(segment);
    }

    /// True if a stream can start: its first segment is there, and starts where the axis rests.
    pub(crate) fn is_stream_ready(&self) -> bool {
        self.mode() == MotionMode::Hold && self.generator.stream.is_ready(self.look_ahead)
    }

    /// True if the stream that waits would move the axis with its first segment.
    pub(crate) fn is_streamed_away(&self) -> bool {
        self.generator.stream.moves_first()
    }

    /// True if the axis' position is that of the machine, so that its travel is in force.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    /// True if the encoder has shown an index pulse since the axis was homed last, or since the start.
    pub fn is_indexed(&self) -> bool {
        self.index.is_seen()
    }

    /// Takes the next sample of the look-ahead reference.
    #[inline(always)]
    pub(super) fn move_reference(&mut self, ahead: &ReferenceSample<S>) {
        self.displacement_before = self.displacement;
        self.displacement = ahead.position - self.look_ahead;
        self.look_ahead = ahead.position;
        self.telemetry.velocity = ahead.velocity;
        self.acceleration = ahead.acceleration;
    }

    #[inline(always)]
    pub(super) fn reference_state(&self) -> ReferenceState {
        ReferenceState {
            position: self.look_ahead,
            displacement: self.displacement,
            before: self.displacement_before,
        }
    }

    /// The largest tracking error since enabling, against its limit.
    pub fn following(&self) -> FollowingState<S> {
        self.following
    }

    /// Declares the present count that of the machine, or not: homing does, and a board whose encoders are absolute.
    pub(crate) fn set_homed(&mut self, homed: bool) {
        if self.homed != homed {
            self.homed = homed;
            self.travel = TravelState::default();
        }
    }
}
