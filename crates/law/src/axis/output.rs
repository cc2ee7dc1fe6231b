//! The output stage of an axis: from volts to a converter's word.

use crate::rounding;
use crate::scalar::{Quantity, Scalar};
use crate::units::DacCode;

/// The output of an axis, and the amplifier that it drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputStage {
    /// Largest output, V; at most `full_scale_v`.
    pub limit_v: f64,
    /// Voltage of the converter's largest code, V.
    pub full_scale_v: f64,
    /// Voltage at which the motor gives no force, V; it is added to every output.
    pub offset_v: f64,
    /// True if a positive voltage moves the axis to smaller positions.
    pub reversed: bool,
}

impl OutputStage {
    /// Outputs of at most `limit_v` from a converter of +-10 V.
    pub const fn limited_to(limit_v: f64) -> Self {
        Self {
            limit_v,
            full_scale_v: 10.0,
            offset_v: 0.0,
            reversed: false,
        }
    }
}

/// The output stage, ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Amplifier<S: Scalar> {
    pub(super) limit: S,
    pub(super) codes_per_volt: S::Gain,
    offset_code: i32,
}

impl<S: Scalar> Amplifier<S> {
    pub(super) fn build(stage: &OutputStage) -> Self {
        let sign = if stage.reversed { -1.0 } else { 1.0 };
        let codes_per_volt = DacCode::FULL_SCALE / stage.full_scale_v;
        Self {
            limit: S::quantise(stage.limit_v, Quantity::Voltage),
            codes_per_volt: S::gain(sign * codes_per_volt, Quantity::Voltage, Quantity::Integer),
            offset_code: rounding::round(stage.offset_v * codes_per_volt) as i32,
        }
    }

    #[inline(always)]
    pub(super) fn code(&self, output: S) -> DacCode {
        DacCode::saturating(
            output
                .round_scaled(self.codes_per_volt)
                .saturating_add(self.offset_code),
        )
    }
}
