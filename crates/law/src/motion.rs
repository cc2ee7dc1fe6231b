//! The reference generator: what the reference of an axis follows at each tick. Its motion modes exclude one another.

use crate::homing::{Homing, HomingEvent, HomingInput, HomingState};
use crate::reference::{
    JogState, Motion, MotionScale, MotionState, Ramp, RampState, ReferenceSample, Stream,
    StreamState, StreamStep, Velocity,
};
use crate::safety::{AxisSwitches, FaultCode};
use crate::scalar::Scalar;
use crate::units::Position;

/// The source that the reference of an axis follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionMode {
    /// Nothing: the reference stands.
    #[default]
    Hold,
    /// The motion of the plan.
    Plan,
    /// A velocity that a person or a host gives.
    Jog,
    /// The homing routine of the axis.
    Home,
    /// Set points from a host.
    Stream,
    /// The ramp of a controlled stop, to rest.
    Stopping,
    /// The axis itself: a host drives the amplifier.
    OpenLoop,
}

/// The reference generator of an axis, ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReferenceGenerator<S: Scalar> {
    stop_ramp: Ramp<S>,
    jog_ramp: Ramp<S>,
    max_velocity: Velocity,
    soft_limits: Option<(Position, Position)>,
    homing: Option<Homing<S>>,
    stream: Stream<S>,
    wait_ticks: u32,
    /// Ticks that a controlled stop may take at most.
    stop_limit: Option<u32>,
    /// Largest velocity of a jog of an axis that is not homed.
    reduced_velocity: Option<Velocity>,
}

impl<S: Scalar> ReferenceGenerator<S> {
    /// A generator that stops along `stop_ramp`, and jogs and homes along `jog_ramp` at up to `max_velocity`. Settings
    /// time only.
    pub fn new(
        stop_ramp: Ramp<S>,
        jog_ramp: Ramp<S>,
        max_velocity: Velocity,
        scale: MotionScale,
    ) -> Self {
        Self {
            stop_ramp,
            jog_ramp,
            max_velocity,
            soft_limits: None,
            homing: None,
            stream: Stream::new(scale),
            wait_ticks: 0,
            stop_limit: None,
            reduced_velocity: None,
        }
    }

    /// Keeps jogs between a lowest and a highest position once the axis is homed.
    #[must_use]
    pub fn with_soft_limits(mut self, limits: Option<(Position, Position)>) -> Self {
        self.soft_limits = limits;
        self
    }

    /// Lets the axis home.
    #[must_use]
    pub fn with_homing(mut self, homing: Option<Homing<S>>) -> Self {
        self.homing = homing;
        self
    }

    /// Delays the start of plans and streams by this many ticks, so that the feedback's reference of every axis starts
    /// in the same tick, independent of their previews.
    #[must_use]
    pub fn with_wait(mut self, ticks: u32) -> Self {
        self.wait_ticks = ticks;
        self
    }

    /// Ends a controlled stop that takes longer than this many ticks with a fault (SS1-t of IEC 61800-5-2).
    #[must_use]
    pub fn with_stop_limit(mut self, ticks: u32) -> Self {
        self.stop_limit = Some(ticks);
        self
    }

    /// Jogs an axis that is not homed at no more than this.
    #[must_use]
    pub fn with_reduced_velocity(mut self, velocity: Option<Velocity>) -> Self {
        self.reduced_velocity = velocity;
        self
    }

    /// The ramp of a controlled stop.
    pub fn stop_ramp(&self) -> &Ramp<S> {
        &self.stop_ramp
    }
}

/// The memory of the reference generator.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GeneratorState<S: Scalar> {
    mode: MotionMode,
    /// Ticks until the motion begins.
    waiting: u32,
    /// Ticks of the controlled stop under way.
    stopping: u32,
    motion: MotionState,
    ramp: RampState,
    jog: JogState,
    homing: HomingState<S>,
    pub(crate) stream: StreamState,
}

impl<S: Scalar> Default for GeneratorState<S> {
    fn default() -> Self {
        Self {
            mode: MotionMode::Hold,
            waiting: 0,
            stopping: 0,
            motion: MotionState::default(),
            ramp: RampState::default(),
            jog: JogState::default(),
            homing: HomingState::default(),
            stream: StreamState::default(),
        }
    }
}

/// The reference after a tick, with the two displacements that led to it: what a stop starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ReferenceState {
    pub(crate) position: Position,
    /// In the last tick.
    pub(crate) displacement: Position,
    /// In the tick before.
    pub(crate) before: Position,
}

impl<S: Scalar> GeneratorState<S> {
    pub(crate) fn mode(&self) -> MotionMode {
        self.mode
    }

    /// Ends the motion that is followed or waits to begin.
    pub(crate) fn hold(&mut self) {
        self.mode = MotionMode::Hold;
        self.waiting = 0;
    }

    /// Holds, and forgets the rest of a stream. The memory of a motion is made again when it starts.
    pub(crate) fn reset(&mut self) {
        self.hold();
        self.stream.clear();
    }
}

/// Request of the generator to the axis in a tick, beside the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GeneratorEvent {
    None,
    /// Shift every position of the axis by this much.
    Origin(Position),
    /// Let the reference go along with the axis.
    Open,
    /// React to a fault.
    Fault(FaultCode),
}

/// Starts. They ask nothing: [`admission`](crate::admission) has decided that the axis is free.
impl<S: Scalar> ReferenceGenerator<S> {
    /// Starts the plan's motion from rest.
    pub(crate) fn start_plan(&self, state: &mut GeneratorState<S>, position: Position) {
        state.motion = MotionState::start(position);
        state.mode = MotionMode::Plan;
        state.waiting = self.wait_ticks;
    }

    /// Starts a jog from rest, or gives the one under way another velocity.
    pub(crate) fn start_jog(
        &self,
        state: &mut GeneratorState<S>,
        position: Position,
        velocity: Velocity,
        homed: bool,
    ) {
        let reduced = self.reduced_velocity.filter(|_| !homed);
        let most = reduced.unwrap_or(self.max_velocity);
        if state.mode != MotionMode::Jog {
            state.ramp = RampState::at_rest(position);
        }
        state.jog = JogState::new(velocity.max(-most).min(most));
        state.mode = MotionMode::Jog;
    }

    /// Starts homing from rest. Returns false for an axis that has no homing.
    pub(crate) fn start_homing(&self, state: &mut GeneratorState<S>, position: Position) -> bool {
        if self.homing.is_none() {
            return false;
        }
        state.ramp = RampState::at_rest(position);
        state.homing = HomingState::default();
        state.mode = MotionMode::Home;
        true
    }

    /// Starts the stream whose first segment is there, from rest.
    pub(crate) fn start_stream(&self, state: &mut GeneratorState<S>) {
        state.mode = MotionMode::Stream;
        state.waiting = self.wait_ticks;
    }

    /// Lets the reference go along with the axis, from rest.
    pub(crate) fn open_loop(&self, state: &mut GeneratorState<S>) {
        state.mode = MotionMode::OpenLoop;
    }

    /// Begins a controlled stop, unless one is under way, and forgets the rest of a stream.
    pub(crate) fn stop(&self, state: &mut GeneratorState<S>, from: ReferenceState) {
        state.stream.clear();
        if matches!(state.mode, MotionMode::Hold | MotionMode::Stopping) {
            return;
        }
        state.ramp = self
            .stop_ramp
            .take_over(from.position, from.displacement, from.before);
        state.waiting = 0;
        state.stopping = 0;
        state.mode = MotionMode::Stopping;
    }
}

impl<S: Scalar> ReferenceGenerator<S> {
    /// The reference of the next tick of an axis that stands at `position` or follows the plan, as most do in most ticks; none
    /// in every other mode.
    #[inline(always)]
    pub(crate) fn advance_plan(
        &self,
        state: &mut GeneratorState<S>,
        motion: &Motion<S>,
        position: Position,
    ) -> Option<ReferenceSample<S>> {
        match state.mode {
            MotionMode::Plan if state.waiting == 0 => {
                let sample = motion.step(&mut state.motion);
                if motion.finished(&state.motion) {
                    state.mode = MotionMode::Hold;
                }
                Some(sample)
            }
            MotionMode::Hold => Some(ReferenceSample::standing(position)),
            _ => None,
        }
    }

    /// The reference of the next tick in every mode for which [`advance_plan`](Self::advance_plan) has none. `homed`: the axis
    /// knows where it is.
    #[inline(never)]
    pub(crate) fn advance(
        &self,
        state: &mut GeneratorState<S>,
        motion: &Motion<S>,
        from: ReferenceState,
        homed: bool,
        input: HomingInput,
    ) -> (ReferenceSample<S>, GeneratorEvent) {
        let standing = ReferenceSample::standing(from.position);
        if state.waiting > 0 {
            state.waiting -= 1;
            if state.mode == MotionMode::Plan && motion.finished(&state.motion) {
                state.hold();
            }
            return (standing, GeneratorEvent::None);
        }
        match (state.mode, &self.homing) {
            (MotionMode::Jog, _) => {
                let limits = self.soft_limits.filter(|_| homed);
                let sample = state.jog.step(&self.jog_ramp, &mut state.ramp, limits);
                if state.jog.finished(&state.ramp) {
                    state.mode = MotionMode::Hold;
                }
                (sample, GeneratorEvent::None)
            }
            (MotionMode::Home, Some(homing)) => self.advance_home(state, homing, input),
            (MotionMode::Stream, _) => match self.stream.step(&mut state.stream) {
                StreamStep::Moving(sample) => (sample, GeneratorEvent::None),
                StreamStep::Finished(sample) => {
                    state.mode = MotionMode::Hold;
                    (sample, GeneratorEvent::None)
                }
                StreamStep::Underrun => {
                    self.stop(state, from);
                    let (sample, _) = self.advance_stop(state);
                    (sample, GeneratorEvent::Fault(FaultCode::StreamUnderrun))
                }
            },
            (MotionMode::OpenLoop, _) => (standing, GeneratorEvent::Open),
            // Homing whose settings have gone ends in a stop as well.
            (MotionMode::Home, None) => {
                self.stop(state, from);
                self.advance_stop(state)
            }
            _ => self.advance_stop(state),
        }
    }

    fn advance_stop(&self, state: &mut GeneratorState<S>) -> (ReferenceSample<S>, GeneratorEvent) {
        let sample = self.stop_ramp.step(&mut state.ramp, Velocity::ZERO);
        if state.ramp.is_at_rest() {
            state.mode = MotionMode::Hold;
        }
        state.stopping = state.stopping.saturating_add(1);
        let event = if self.stop_limit.is_some_and(|most| state.stopping > most) {
            GeneratorEvent::Fault(FaultCode::StopOverrun)
        } else {
            GeneratorEvent::None
        };
        (sample, event)
    }

    fn advance_home(
        &self,
        state: &mut GeneratorState<S>,
        homing: &Homing<S>,
        input: HomingInput,
    ) -> (ReferenceSample<S>, GeneratorEvent) {
        let (sample, event) = homing.step(
            &self.jog_ramp,
            &mut state.homing,
            &mut state.ramp,
            &mut state.motion,
            input,
        );
        let event = match event {
            HomingEvent::None => GeneratorEvent::None,
            HomingEvent::Origin(offset) => GeneratorEvent::Origin(offset),
            HomingEvent::Finished => {
                state.mode = MotionMode::Hold;
                GeneratorEvent::None
            }
            HomingEvent::Failed(code) => GeneratorEvent::Fault(code),
        };
        (sample, event)
    }

    /// The switch that the axis is meant to move onto, if there is one.
    #[inline(always)]
    pub(crate) fn expected(&self, state: &GeneratorState<S>) -> AxisSwitches {
        match &self.homing {
            Some(homing) if state.mode == MotionMode::Home => homing.switch(),
            _ => AxisSwitches::default(),
        }
    }
}
