//! The integral where friction fed forward fades, and returns.
//!
//! Without friction fed forward the integral takes it up, as far as strokes are long enough. What returns would act beside it, and throw
//! the axis by twice the friction; so the integral gives back what it has taken up since, up to what returns. The rest of what returns is
//! friction that the error holds, which then vanishes.

use crate::scalar::Scalar;

/// The memory of an axis whose friction feedforward may fade.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FadingState<S> {
    /// The integral when all of the friction last acted, or the axis first set off, V.
    whole: Option<S>,
}

impl<S: Scalar> FadingState<S> {
    /// Takes note of the integral, V, while all of the friction acts.
    pub(super) fn begin(&mut self, integral: S) {
        self.whole = Some(integral);
    }

    /// Takes note of the integral, V, with which the axis first sets off: it holds the load.
    pub(super) fn set_off(&mut self, integral: S) {
        self.whole.get_or_insert(integral);
    }

    /// Voltage that the integral, V, has taken up since.
    pub(super) fn taken_up(&self, integral: S) -> S {
        self.whole.map_or(S::ZERO, |whole| integral - whole)
    }

    /// Voltage that the integral, V, is to give back as friction of a voltage returns.
    pub(super) fn returns(&self, integral: S, friction: S) -> S {
        let taken_up = self.taken_up(integral);
        if friction > S::ZERO {
            taken_up.limit(S::ZERO, friction)
        } else {
            taken_up.limit(friction, S::ZERO)
        }
    }

    /// Takes note of a voltage that was taken from the integral, V.
    pub(super) fn unload(&mut self, voltage: S) {
        if let Some(whole) = &mut self.whole {
            *whole = *whole - voltage;
        }
    }
}
