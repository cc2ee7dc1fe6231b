//! What an axis remembers from tick to tick.

use super::PREVIEW_ROOM;
use crate::law::control::feedback::FeedbackState;
use crate::law::course::{CourseMode, CourseState, Standing};
use crate::law::encoder::EncoderState;
use crate::law::feedforward::{FeedforwardState, ReferenceStep};
use crate::law::reference::Segment;
use crate::law::safety::FaultCode;
use crate::law::safety::monitor::{FollowingState, IndexState, OverspeedState, SilenceState};
use crate::law::safety::travel::TravelState;
use crate::law::scalar::Scalar;
use crate::law::telemetry::AxisTelemetry;
use crate::law::units::Position;

/// The memory of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisState<S: Scalar, const N: usize> {
    pub(super) encoder: EncoderState,
    pub(super) course: CourseState<S>,
    /// Where the axis was at the last index pulse, until homing takes it.
    pub(super) pulse: Option<Position>,
    /// What speaks against the axis in this tick, until the stage takes it.
    pub(crate) suspect: Option<FaultCode>,
    /// The travel is in force.
    pub(super) homed: bool,
    pub(super) overspeed: OverspeedState,
    pub(super) silence: SilenceState,
    pub(super) index: IndexState,
    pub(super) following: FollowingState<S>,
    pub(super) travel: TravelState,
    /// The displacement of the reference at the feedforward's tick, and in the tick before.
    pub(super) displacement: Position,
    pub(super) displacement_before: Position,
    /// The reference's step at the feedforward's tick.
    pub(super) step: ReferenceStep<S>,
    /// The reference at the feedforward's tick, ahead of the feedback's.
    pub(super) ahead: Position,
    pub(super) preview: [Position; PREVIEW_ROOM],
    /// Velocity of the feedback's reference, for a law that needs it.
    pub(super) velocity: S,
    pub(super) feedback: FeedbackState<S>,
    pub(super) springs: FeedforwardState<S, N>,
    pub(super) transfer: S,
    /// What a host adds to the output in this tick, V.
    pub(super) injected: S,
    pub(super) last_output: S,
    pub(super) telemetry: AxisTelemetry<S>,
}

impl<S: Scalar, const N: usize> Default for AxisState<S, N> {
    fn default() -> Self {
        Self {
            encoder: EncoderState::default(),
            course: CourseState::default(),
            pulse: None,
            suspect: None,
            homed: false,
            overspeed: OverspeedState::default(),
            silence: SilenceState::default(),
            index: IndexState::default(),
            following: FollowingState::default(),
            travel: TravelState::default(),
            displacement: Position::ZERO,
            displacement_before: Position::ZERO,
            step: ReferenceStep::default(),
            ahead: Position::ZERO,
            preview: [Position::ZERO; PREVIEW_ROOM],
            velocity: S::ZERO,
            feedback: FeedbackState::default(),
            springs: FeedforwardState::default(),
            transfer: S::ZERO,
            injected: S::ZERO,
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
        self.course.mode() != CourseMode::Hold
    }

    /// What the reference follows.
    pub fn mode(&self) -> CourseMode {
        self.course.mode()
    }

    /// What a host adds to the output, V.
    #[inline(always)]
    pub fn injected(&self) -> S {
        self.injected
    }

    /// Where the axis is.
    #[inline(always)]
    pub(crate) fn measured(&self) -> Position {
        self.encoder.position()
    }

    /// How fast it is, 2^-8 counts per tick.
    #[inline(always)]
    pub(crate) fn speed(&self) -> i32 {
        self.overspeed.speed()
    }

    /// Sets what is added to the output from this tick on, V.
    pub(crate) fn inject(&mut self, voltage: S) {
        self.injected = voltage;
    }

    /// Where the reference stands, ahead of the feedback's by the preview.
    pub fn reference(&self) -> Position {
        self.ahead
    }

    /// Whether the axis has room for a segment of a stream.
    #[inline(always)]
    pub fn wants_segment(&self) -> bool {
        self.course.stream.wants_segment()
    }

    /// Gives the axis the next segment of a stream; call it when [`AxisState::wants_segment`]. What is left of a stream
    /// that was broken off is dropped.
    #[inline(always)]
    pub(crate) fn offer_segment(&mut self, segment: Segment) {
        self.course.stream.offer(segment);
    }

    /// Whether a stream can start: its first segment is there, and starts where the axis rests.
    pub fn is_stream_ready(&self) -> bool {
        self.course.mode() == CourseMode::Hold && self.course.stream.is_ready(self.ahead)
    }

    /// Whether the axis' position is that of the machine, so that its travel is in force.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    #[inline(always)]
    pub(super) fn standing(&self) -> Standing {
        Standing {
            position: self.ahead,
            displacement: self.displacement,
            before: self.displacement_before,
        }
    }

    /// The largest tracking error since enabling, against its limit.
    #[inline(always)]
    pub fn following(&self) -> FollowingState<S> {
        self.following
    }

    /// The largest tracking error since enabling as a share of its limit at the time: above 1 after a following error.
    /// It stays until the next enabling. For telemetry; it divides.
    pub fn following_high_mark(&self) -> f32 {
        self.following.high_mark()
    }

    /// Says whether the present count is that of the machine: homing does, and a board whose encoders know where they
    /// are.
    pub(crate) fn set_homed(&mut self, homed: bool) {
        if self.homed != homed {
            self.homed = homed;
            self.travel = TravelState::default();
        }
    }
}
