//! Jogging: a velocity that holds until it is changed, and that ends by itself before the end of the travel.

use super::ramp::{Ramp, RampState, Velocity};
use super::sample::ReferenceSample;
use crate::scalar::Scalar;
use crate::units::Position;

/// The target of a jog.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JogState {
    target: Velocity,
    /// It brakes for the end of the travel, and goes on braking: without this it would speed up again with every
    /// millionth of a millimetre that the bound of the braking distance leaves over.
    held_back: bool,
}

impl JogState {
    /// A jog at `target`.
    pub const fn new(target: Velocity) -> Self {
        Self {
            target,
            held_back: false,
        }
    }

    /// True if it has come to its end: it rests and nothing asks for motion.
    pub fn finished(&self, ramp: &RampState) -> bool {
        (self.held_back || self.target == Velocity::ZERO) && ramp.is_at_rest()
    }

    /// The reference of the next tick along `ramp`. With a lowest and a highest position the jog comes to rest within
    /// them; beyond them it moves back only.
    pub fn step<S: Scalar>(
        &mut self,
        ramp: &Ramp<S>,
        state: &mut RampState,
        span: Option<(Position, Position)>,
    ) -> ReferenceSample<S> {
        let Some((lowest, highest)) = span else {
            return ramp.step(state, self.target);
        };
        if !self.held_back {
            let mut trial = *state;
            let sample = ramp.step(&mut trial, self.target);
            let [backward, forward] = ramp.stop_reach(&trial);
            let backward_clear = backward == Position::ZERO || trial.position() - lowest > backward;
            let forward_clear = forward == Position::ZERO || highest - trial.position() > forward;
            if backward_clear && forward_clear {
                *state = trial;
                return sample;
            }
            self.held_back = true;
        }
        ramp.step(state, Velocity::ZERO)
    }
}
