//! The signals and the memory that all feedback laws share.

use crate::scalar::Scalar;

/// Inputs of a law in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedbackInput<S> {
    /// Tracking error e, mm.
    pub error: S,
    /// Velocity of the reference, mm/s; only the laws that `Feedback::needs_velocity` names read it.
    pub velocity: S,
}

/// The memory of a law, the same for all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeedbackState<S: Scalar> {
    /// The integral's sum, V.
    pub(super) integral: S::Sum,
    /// The filtered derivative, V.
    pub(super) derivative: S,
    /// The error that was differentiated last, mm.
    pub(super) last_error: S,
}

impl<S: Scalar> FeedbackState<S> {
    /// The integral, V.
    pub(crate) fn integral(&self) -> S {
        S::total(self.integral)
    }

    /// Takes a voltage from the integral that a feedforward now gives, V.
    pub(crate) fn unload(&mut self, voltage: S) {
        if voltage != S::ZERO {
            self.integral = (S::total(self.integral) - voltage).into_sum();
        }
    }
}

/// Outputs of a law, term by term, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedbackTerms<S> {
    /// The term that follows the error itself. PID: Kp f. Cascade: G (v_set - v_ref). Sliding mode: the saturated surface.
    /// NCTF: G n(e).
    pub proportional: S,
    /// The integral of the driving error, V.
    pub integral: S,
    /// The term that follows the error's filtered rate.
    pub derivative: S,
    /// The sum, within the bounds given to the step; in telemetry, behind the axis' filters.
    pub output: S,
    /// True if the bounds cut the output.
    pub saturated: bool,
}
