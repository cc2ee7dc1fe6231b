//! The state that the single-state models share: the force that the deflected bristles of a surface carry.

use crate::scalar::Scalar;

/// The memory of a model with a single state; slack bristles by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bristle<S> {
    pub(super) force: S,
}

impl<S: Scalar> Bristle<S> {
    /// Bristles that carry a force, V.
    pub fn bent(force: S) -> Self {
        Self { force }
    }

    /// Lets them carry `change` more, V.
    pub(crate) fn load(&mut self, change: S) {
        self.force = self.force + change;
    }

    /// The force of the bristles, `sigma0 z`, V.
    pub fn force(&self) -> S {
        self.force
    }
}
