//! What the reference of an axis follows: nothing, the plan's motion, a jog, homing, a stream, or the ramp to rest.

use crate::law::homing::{Homing, HomingEvent, HomingInput, HomingState};
use crate::law::reference::{
    JogState, Motion, MotionState, Ramp, RampState, ReferenceSample, Stream, StreamState,
    StreamStep, Velocity,
};
use crate::law::safety::{AxisSwitches, FaultCode};
use crate::law::scalar::Scalar;
use crate::law::units::Position;

/// What an axis can follow, ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Course<S: Scalar> {
    /// What a stop follows.
    pub(crate) braking: Ramp<S>,
    /// What jogs and homing follow.
    pub(crate) moving: Ramp<S>,
    /// The fastest jog.
    pub(crate) fastest: Velocity,
    /// Lowest and highest position of a jog, once the axis is homed.
    pub(crate) span: Option<(Position, Position)>,
    pub(crate) homing: Option<Homing<S>>,
    pub(crate) stream: Stream<S>,
    /// How long a motion waits, so that the feedback's reference starts when that of every axis does.
    pub(crate) wait_ticks: u32,
}

/// What is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CourseMode {
    /// Nothing: the reference stands.
    #[default]
    Hold,
    /// The plan's motion.
    Plan,
    /// A velocity.
    Jog,
    /// Homing.
    Home,
    /// Set points from a host.
    Stream,
    /// The braking ramp, to rest.
    Stopping,
    /// The axis: a host drives the amplifier.
    OpenLoop,
}

/// How far it has come.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CourseState<S: Scalar> {
    mode: CourseMode,
    /// Ticks until the motion begins.
    waiting: u32,
    motion: MotionState,
    ramp: RampState,
    jog: JogState,
    homing: HomingState<S>,
    pub(crate) stream: StreamState,
}

impl<S: Scalar> Default for CourseState<S> {
    fn default() -> Self {
        Self {
            mode: CourseMode::Hold,
            waiting: 0,
            motion: MotionState::default(),
            ramp: RampState::default(),
            jog: JogState::default(),
            homing: HomingState::default(),
            stream: StreamState::default(),
        }
    }
}

/// Where the reference stands and how it came there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Standing {
    pub(crate) position: Position,
    /// In the last tick.
    pub(crate) displacement: Position,
    /// In the tick before.
    pub(crate) before: Position,
}

impl<S: Scalar> CourseState<S> {
    pub(crate) fn mode(&self) -> CourseMode {
        self.mode
    }

    /// Ends whatever is followed.
    #[inline(always)]
    pub(crate) fn hold(&mut self) {
        self.mode = CourseMode::Hold;
    }
}

/// What a course finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CourseEvent {
    None,
    /// Every position of the axis is to be shifted by this much.
    Origin(Position),
    /// The reference goes along with the axis.
    Open,
    Fault(FaultCode),
}

impl<S: Scalar> Course<S> {
    /// Starts the plan's motion from rest.
    pub(crate) fn run(&self, state: &mut CourseState<S>, position: Position) {
        if state.mode != CourseMode::Hold {
            return;
        }
        state.motion = MotionState::start(position);
        state.mode = CourseMode::Plan;
        state.waiting = self.wait_ticks;
    }

    /// Starts a jog from rest, or gives the one under way another velocity; does nothing while anything else is
    /// followed.
    pub(crate) fn jog(&self, state: &mut CourseState<S>, position: Position, velocity: Velocity) {
        match state.mode {
            CourseMode::Hold => state.ramp = RampState::at_rest(position),
            CourseMode::Jog => {}
            _ => return,
        }
        state.jog = JogState::new(velocity.max(-self.fastest).min(self.fastest));
        state.mode = CourseMode::Jog;
    }

    /// Starts homing from rest; says whether it did.
    pub(crate) fn home(&self, state: &mut CourseState<S>, position: Position) -> bool {
        if state.mode != CourseMode::Hold || self.homing.is_none() {
            return false;
        }
        state.ramp = RampState::at_rest(position);
        state.homing = HomingState::default();
        state.mode = CourseMode::Home;
        true
    }

    /// Starts the stream whose first segment is there, from rest.
    pub(crate) fn run_stream(&self, state: &mut CourseState<S>) {
        if state.mode != CourseMode::Hold {
            return;
        }
        state.mode = CourseMode::Stream;
        state.waiting = self.wait_ticks;
    }

    /// Lets the reference go along with the axis, from rest.
    pub(crate) fn open(&self, state: &mut CourseState<S>) {
        if state.mode == CourseMode::Hold {
            state.mode = CourseMode::OpenLoop;
        }
    }

    /// Brakes what is under way, unless it brakes already, and forgets what is there of a stream.
    pub(crate) fn stop(&self, state: &mut CourseState<S>, from: Standing) {
        state.stream.clear();
        if matches!(state.mode, CourseMode::Hold | CourseMode::Stopping) {
            return;
        }
        state.ramp = self
            .braking
            .take_over(from.position, from.displacement, from.before);
        state.mode = CourseMode::Stopping;
    }

    /// The reference of the next tick. `homed`: the axis knows where it is.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &mut CourseState<S>,
        motion: &Motion<S>,
        from: Standing,
        homed: bool,
        input: HomingInput,
    ) -> (ReferenceSample<S>, CourseEvent) {
        if state.mode == CourseMode::Plan && state.waiting == 0 {
            let sample = motion.step(&mut state.motion);
            if motion.finished(&state.motion) {
                state.mode = CourseMode::Hold;
            }
            return (sample, CourseEvent::None);
        }
        let standing = ReferenceSample {
            position: from.position,
            ..ReferenceSample::default()
        };
        if state.mode == CourseMode::Hold {
            return (standing, CourseEvent::None);
        }
        if state.waiting > 0 {
            state.waiting -= 1;
            if state.mode == CourseMode::Plan && motion.finished(&state.motion) {
                state.mode = CourseMode::Hold;
            }
            return (standing, CourseEvent::None);
        }
        self.advance_otherwise(state, from, homed, input)
    }

    /// The same for what is not the plan's.
    #[inline(never)]
    fn advance_otherwise(
        &self,
        state: &mut CourseState<S>,
        from: Standing,
        homed: bool,
        input: HomingInput,
    ) -> (ReferenceSample<S>, CourseEvent) {
        match (state.mode, &self.homing) {
            (CourseMode::Jog, _) => {
                let span = self.span.filter(|_| homed);
                let sample = state.jog.step(&self.moving, &mut state.ramp, span);
                if state.jog.finished(&state.ramp) {
                    state.mode = CourseMode::Hold;
                }
                (sample, CourseEvent::None)
            }
            (CourseMode::Home, Some(homing)) => self.advance_home(state, homing, input),
            (CourseMode::Stream, _) => match self.stream.step(&mut state.stream) {
                StreamStep::Moving(sample) => (sample, CourseEvent::None),
                StreamStep::Finished(sample) => {
                    state.mode = CourseMode::Hold;
                    (sample, CourseEvent::None)
                }
                StreamStep::Underrun => {
                    self.stop(state, from);
                    (
                        self.brake(state),
                        CourseEvent::Fault(FaultCode::StreamUnderrun),
                    )
                }
            },
            (CourseMode::OpenLoop, _) => {
                let standing = ReferenceSample {
                    position: from.position,
                    ..ReferenceSample::default()
                };
                (standing, CourseEvent::Open)
            }
            // Homing whose settings have gone brakes as well.
            (CourseMode::Home, None) => {
                self.stop(state, from);
                (self.brake(state), CourseEvent::None)
            }
            _ => (self.brake(state), CourseEvent::None),
        }
    }

    fn brake(&self, state: &mut CourseState<S>) -> ReferenceSample<S> {
        let sample = self.braking.step(&mut state.ramp, Velocity::ZERO);
        if state.ramp.is_at_rest() {
            state.mode = CourseMode::Hold;
        }
        sample
    }

    fn advance_home(
        &self,
        state: &mut CourseState<S>,
        homing: &Homing<S>,
        input: HomingInput,
    ) -> (ReferenceSample<S>, CourseEvent) {
        let (sample, event) = homing.step(
            &self.moving,
            &mut state.homing,
            &mut state.ramp,
            &mut state.motion,
            input,
        );
        let event = match event {
            HomingEvent::None => CourseEvent::None,
            HomingEvent::Origin(offset) => CourseEvent::Origin(offset),
            HomingEvent::Finished => {
                state.mode = CourseMode::Hold;
                CourseEvent::None
            }
            HomingEvent::Failed(code) => CourseEvent::Fault(code),
        };
        (sample, event)
    }

    /// Whether a pressed limit switch is one that the axis is meant to move onto.
    #[inline(always)]
    pub(crate) fn expects(&self, state: &CourseState<S>, switches: AxisSwitches) -> bool {
        state.mode == CourseMode::Home
            && self
                .homing
                .as_ref()
                .is_some_and(|homing| homing.expects(switches))
    }
}
