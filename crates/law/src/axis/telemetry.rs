//! Every term of one axis' law at one tick.

use crate::control::terms::FeedbackTerms;
use crate::feedforward::FeedforwardTerms;
use crate::scalar::{Quantity, Scalar};
use crate::units::{DacCode, EncoderCount, Position};

/// The limit that acts on an axis' output in this tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LimitedBy {
    /// No limit acts on it.
    #[default]
    Nothing,
    /// The output limit of the amplifier's settings.
    OutputLimit,
}

/// One axis at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisTelemetry<S> {
    /// Reference position of the feedback, 2^-16 counts.
    pub reference: Position,
    /// Measured position in whole counts.
    pub measured: EncoderCount,
    /// Tracking error e, reference minus measured, mm.
    pub error: S,
    /// Velocity of the reference, mm/s, as far ahead as the feedforward looks.
    pub velocity: S,
    /// Feedback, term by term.
    pub feedback: FeedbackTerms<S>,
    /// Feedforward, term by term.
    pub feedforward: FeedforwardTerms<S>,
    /// Rest of the offset that made the last change of settings bumpless, V.
    pub bumpless_offset: S,
    /// Output after all limits, V.
    pub output: S,
    /// The word sent to the converter.
    pub code: DacCode,
    /// The sum of all words so far, this one included; wraps.
    pub code_sum: i32,
    /// The limit that acts on the output.
    pub limited_by: LimitedBy,
}

impl<S: Scalar> AxisTelemetry<S> {
    /// Tracking error, reference minus measured, mm.
    pub fn error_mm(&self) -> f32 {
        self.error.to_f32(Quantity::Length)
    }

    /// Output after all limits, V.
    pub fn output_v(&self) -> f32 {
        self.output.to_f32(Quantity::Voltage)
    }
}
