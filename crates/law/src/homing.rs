//! Homing: the search for the position of the axis in the machine.
//!
//! ```text
//!   Look -> Search --switch--> Brake -> Retract --released--> Index --pulse--> Settle --origin--> Park
//!     |     to the switch               away from it,          the same way             to the parking position
//!     +--- on the switch already -----> slowly
//! ```
//!
//! The reference mark is met while the axis moves slowly away from the switch, always in the same sense, so backlash
//! does not enter. With an index it is the pulse that follows the release of the switch, whose count the hardware
//! latches: it does not depend on where exactly the switch lets go, as long as that is not near a pulse itself, which is
//! refused. The origin is defined at rest, by shifting every position of the axis alike: nothing moves by it.

use crate::friction::Direction;
use crate::reference::{Approach, Motion, MotionState, Ramp, RampState, ReferenceSample, Velocity};
use crate::safety::{AxisSwitches, FaultCode};
use crate::scalar::Scalar;
use crate::units::Position;

/// The homing routine of an axis, ready for the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Homing<S: Scalar> {
    parameters: HomingParameters,
    approach: Approach<S>,
}

/// The parameters of homing, in the units of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingParameters {
    /// The end of the axis towards which the switch is searched.
    pub direction: Direction,
    /// The switch that is searched.
    pub switch: AxisSwitches,
    /// Velocity of the search; not negative.
    pub search_velocity: Velocity,
    /// Velocity away from the switch and to the index pulse; not negative, at most that of the search.
    pub creep_velocity: Velocity,
    /// Readings against the accepted state that are taken for bounce.
    pub debounce_ticks: u32,
    /// Ticks at rest before the origin is defined.
    pub settle_ticks: u32,
    /// Distance between index pulses; none: the release of the switch is the reference mark.
    pub index_spacing: Option<Position>,
    /// Position that the reference mark is to have.
    pub home_offset: Position,
    /// Position that the axis moves to in the end.
    pub parking: Position,
    /// Largest distance to the switch, and off it.
    pub travel: Position,
}

/// Inputs of homing in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomingInput {
    /// The switches of the axis.
    pub switches: AxisSwitches,
    /// Position at the index pulse, if one passed since the last tick.
    pub index: Option<Position>,
    /// Measured position, 2^-16 counts.
    pub measured: Position,
}

/// Request of homing in a tick, beside the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingEvent {
    /// Go on as before.
    None,
    /// Shift every position of the axis by this much: then they are the machine's.
    Origin(Position),
    /// End: the axis rests at its parking position.
    Finished,
    /// End: the reference mark was not found, or is not to be trusted.
    Failed(FaultCode),
}

/// The step of the routine that is under way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    /// Standing, until the switch has been read often enough.
    #[default]
    Look,
    /// Moving to the switch.
    Search,
    /// To rest beyond its edge.
    Brake,
    /// Away, until it lets go.
    Retract,
    /// Further away, to the index pulse.
    Index,
    /// To rest beyond the mark.
    Settle,
    /// To the parking position.
    Park,
}

/// A switch behind its bounce.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Debounced {
    pressed: bool,
    /// Readings in a row that say otherwise.
    against: u32,
    /// Position at the first of them.
    edge: Position,
}

impl Debounced {
    fn update(&mut self, pressed: bool, measured: Position, bounce_ticks: u32) {
        if pressed == self.pressed {
            self.against = 0;
            return;
        }
        if self.against == 0 {
            self.edge = measured;
        }
        self.against += 1;
        if self.against > bounce_ticks {
            self.pressed = pressed;
            self.against = 0;
        }
    }
}

/// The memory of homing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HomingState<S: Scalar> {
    phase: Phase,
    switch: Debounced,
    /// Ticks in the phase.
    ticks: u32,
    /// Reference at the beginning of the phase.
    from: Position,
    /// Position at which the reference mark was met.
    mark: Position,
    parking: Motion<S>,
}

impl<S: Scalar> HomingState<S> {
    fn enter(&mut self, phase: Phase, position: Position) {
        self.phase = phase;
        self.ticks = 0;
        self.from = position;
    }
}

impl<S: Scalar> Homing<S> {
    /// Homing with a last move within the limits of `approach`. Settings time only.
    pub fn new(parameters: HomingParameters, approach: Approach<S>) -> Self {
        Self {
            parameters,
            approach,
        }
    }

    /// The switch that this homing moves onto.
    pub(crate) fn switch(&self) -> AxisSwitches {
        self.parameters.switch
    }

    /// The reference of the next tick along `ramp`, whose state is `moving`; `parked` is the state of the last move.
    #[inline(never)]
    pub fn step(
        &self,
        ramp: &Ramp<S>,
        state: &mut HomingState<S>,
        moving: &mut RampState,
        parked: &mut MotionState,
        input: HomingInput,
    ) -> (ReferenceSample<S>, HomingEvent) {
        let pressed = input.switches.has(self.parameters.switch);
        state
            .switch
            .update(pressed, input.measured, self.parameters.debounce_ticks);
        state.ticks = state.ticks.saturating_add(1);
        if state.phase == Phase::Park {
            let sample = state.parking.step(parked);
            let event = if state.parking.finished(parked) {
                HomingEvent::Finished
            } else {
                HomingEvent::None
            };
            return (sample, event);
        }
        let event = self.decide(state, moving, parked, input);
        if let HomingEvent::Origin(offset) = event {
            *moving = RampState::at_rest(moving.position() + offset);
        }
        let target = match (state.phase, self.parameters.direction) {
            (Phase::Search, Direction::Positive) => self.parameters.search_velocity,
            (Phase::Search, Direction::Negative) => -self.parameters.search_velocity,
            (Phase::Retract | Phase::Index, Direction::Positive) => -self.parameters.creep_velocity,
            (Phase::Retract | Phase::Index, Direction::Negative) => self.parameters.creep_velocity,
            _ => Velocity::ZERO,
        };
        (ramp.step(moving, target), event)
    }

    fn decide(
        &self,
        state: &mut HomingState<S>,
        moving: &RampState,
        parked: &mut MotionState,
        input: HomingInput,
    ) -> HomingEvent {
        let here = moving.position();
        let gone = (here - state.from).0.unsigned_abs();
        let pressed = state.switch.pressed;
        let too_far = gone > self.parameters.travel.0.unsigned_abs();
        match state.phase {
            Phase::Look if state.ticks > self.parameters.debounce_ticks + 1 => {
                let phase = if pressed {
                    Phase::Retract
                } else {
                    Phase::Search
                };
                state.enter(phase, here);
            }
            Phase::Search if pressed => state.enter(Phase::Brake, here),
            Phase::Search if too_far => return HomingEvent::Failed(FaultCode::HomeSwitchMissing),
            Phase::Brake if moving.is_at_rest() => state.enter(Phase::Retract, here),
            Phase::Retract if !pressed => {
                state.mark = state.switch.edge;
                let next = if self.parameters.index_spacing.is_some() {
                    Phase::Index
                } else {
                    Phase::Settle
                };
                state.enter(next, here);
            }
            Phase::Retract if too_far => return HomingEvent::Failed(FaultCode::HomeSwitchStuck),
            Phase::Index => return self.await_index(state, here, gone, input.index),
            Phase::Settle if !moving.is_at_rest() => state.ticks = 0,
            // The feedback's reference follows by the preview, and the axis by its lag.
            Phase::Settle if state.ticks > self.parameters.settle_ticks => {
                let offset = self.parameters.home_offset - state.mark;
                let parking = self.approach.aim(self.parameters.parking - (here + offset));
                *parked = MotionState::start(here + offset);
                state.parking = Motion::PointToPoint(parking);
                state.phase = Phase::Park;
                return HomingEvent::Origin(offset);
            }
            _ => {}
        }
        HomingEvent::None
    }

    fn await_index(
        &self,
        state: &mut HomingState<S>,
        here: Position,
        gone: u64,
        index: Option<Position>,
    ) -> HomingEvent {
        let spacing = self
            .parameters
            .index_spacing
            .unwrap_or_default()
            .0
            .unsigned_abs();
        let margin = spacing / INDEX_MARGIN;
        if let Some(index) = index {
            let distance = (index - state.mark).0.unsigned_abs();
            if distance < margin || distance > spacing - margin {
                return HomingEvent::Failed(FaultCode::IndexNearSwitch);
            }
            state.mark = index;
            state.enter(Phase::Settle, here);
        } else if gone > spacing + margin {
            return HomingEvent::Failed(FaultCode::IndexMissing);
        }
        HomingEvent::None
    }
}

/// The switch must let go at least this part of a revolution away from the index pulses: else its scatter decides which
/// of them is met.
const INDEX_MARGIN: u64 = 8;
