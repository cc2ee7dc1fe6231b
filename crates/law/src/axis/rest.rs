//! The memory of an axis at rest: the friction that its integral takes up.
//!
//! An axis that stands is held by its friction, so that its voltage is the friction's force. After a stop it creeps back into its
//! place, by micrometres; the integral sees to it, and friction changes by as much as the integral does. The feedforward knows the
//! reference alone, which stands. So when the reference sets off, the pre-sliding model adopts the integral's change
//! since the stop, and the integral gives it back: the output stays as it is, and the model begins with the friction of the axis. Of a model that
//! acts by a share, the output changes by that share, and so does the integral.
//!
//! The static model knows no rest: its whole level begins with the motion, and the integral gives its change back for it.
//!
//! The integral keeps its voltage of the moment at which the reference stopped: an offset, gravity. A load that changes at rest
//! cannot be distinguished from friction by the encoder, and goes to the model, too, up to the breakaway level.

use crate::scalar::Scalar;

/// The memory of the last stop.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RestState<S> {
    /// The reference moves.
    moves: bool,
    /// The integral when it came to a stop, V; none if something else than friction may have moved it since.
    integral: Option<S>,
}

impl<S: Scalar> RestState<S> {
    /// True if the reference sets off or stops, by whether it moves now.
    pub(super) fn changes(&self, moves: bool) -> bool {
        self.moves != moves
    }

    /// Takes note of a stop, with the integral at it, V.
    pub(super) fn stop(&mut self, integral: S) {
        self.moves = false;
        self.integral = Some(integral);
    }

    /// Takes note of a start; returns by how much the integral has moved since the stop, V: friction has with it.
    pub(super) fn set_off(&mut self, integral: S) -> Option<S> {
        self.moves = true;
        self.integral.take().map(|before| integral - before)
    }

    /// Forgets the stop.
    pub(super) fn forget(&mut self) {
        self.integral = None;
    }

    /// Takes note of a voltage that was taken from the integral, V.
    pub(super) fn unload(&mut self, voltage: S) {
        if let Some(integral) = &mut self.integral {
            *integral = *integral - voltage;
        }
    }
}
