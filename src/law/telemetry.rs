//! Observable terms of one tick of one axis.

use crate::law::control::feedback::FeedbackTerms;
use crate::law::feedforward::FeedforwardTerms;
use crate::law::scalar::{Quantity, Scalar};
use crate::law::units::{DacCode, EncoderCount, Position};

/// The active limit of an axis' output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LimitedBy {
    /// Nothing.
    #[default]
    Nothing,
    /// The output limit.
    OutputLimit,
}

/// One axis at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisTelemetry<S> {
    /// Reference position.
    pub reference: Position,
    /// Measured position.
    pub measured: EncoderCount,
    /// Tracking error e, reference minus measured, mm.
    pub error: S,
    /// Velocity of the reference, mm/s, as far ahead as the feedforward looks.
    pub velocity: S,
    /// Feedback, term by term.
    pub feedback: FeedbackTerms<S>,
    /// Feedforward, term by term.
    pub feedforward: FeedforwardTerms<S>,
    /// What remains of the offset that made the last change of settings bumpless, V.
    pub transfer: S,
    /// Output after all limits, V.
    pub output: S,
    /// The word sent to the converter.
    pub code: DacCode,
    /// The sum of all words so far, this one included; wraps.
    pub code_sum: i32,
    /// What limits the output.
    pub limited_by: LimitedBy,
}

impl<S: Scalar> AxisTelemetry<S> {
    /// Tracking error, mm.
    pub fn error_mm(&self) -> f32 {
        self.error.to_f32(Quantity::Length)
    }

    /// Output, V.
    pub fn output_v(&self) -> f32 {
        self.output.to_f32(Quantity::Voltage)
    }
}
