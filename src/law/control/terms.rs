//! The signals and the memory that all feedback laws share.

use crate::law::scalar::Scalar;

/// What a law reads in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedbackInput<S> {
    /// Tracking error e, mm.
    pub error: S,
    /// Velocity of the reference, mm/s; only the laws that [`Feedback::needs_velocity`] names read it.
    pub velocity: S,
}

/// The memory of a law, the same for all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeedbackState<S: Scalar> {
    /// The integral, V.
    pub(super) integral: S::Sum,
    /// The filtered derivative, V.
    pub(super) derivative: S,
    /// What was differentiated last, mm.
    pub(super) last_error: S,
}

/// What a law put out, term by term, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedbackTerms<S> {
    /// What follows the error itself. PID: Kp f. Cascade: G (v_set - v_ref). Sliding mode: the saturated surface.
    /// NCTF: G n(e).
    pub proportional: S,
    /// The integral.
    pub integral: S,
    /// What follows the error's filtered rate.
    pub derivative: S,
    /// The sum, within the bounds given to the step.
    pub output: S,
    /// Whether the bounds cut the output.
    pub saturated: bool,
}
