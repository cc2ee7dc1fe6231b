//! Making 12 bits do better than 12 bits: the error of one conversion is taken into account in the next.
//!
//! The on-chip converters of a microcontroller have 12 bits: over ±10 V a step is 4.9 mV. An error-feedback quantiser
//! (a digital delta-sigma modulator without its filter) adds what was lost in the past to what comes next, so that the
//! mean over time is exact to far below a step, and the error is pushed to high frequencies, where amplifier and mass
//! do not follow:
//!
//! ```text
//!   v(n) = x(n) + c1 e(n-1) + c2 e(n-2)      first order: c1 = 1, c2 = 0;  second order: c1 = 2, c2 = -1
//!   y(n) = round(v(n) / 16)                   within the converter's range
//!   e(n) = v(n) - 16 y(n)                     within +-8 unless y is at the end of its range
//! ```
//!
//! y's spectrum is then x's plus e's times `1 - z^-1` (first order) or `(1 - z^-1)^2` (second order). Source: S. K. Tewksbury
//! and R. W. Hallock, "Oversampled, linear predictive and noise-shaping coders of order N > 1", IEEE Trans. Circuits
//! Syst. 25 (1978).

use crate::units::DacCode;

/// Bits that the converter lacks.
const MISSING_BITS: u32 = 4;
/// One step of the converter, in codes.
const STEP: i32 = 1 << MISSING_BITS;
/// The converter's words, as a signed number.
const LOWEST: i32 = -2048;
const HIGHEST: i32 = 2047;
/// Errors beyond this come from a converter at the end of its range: remembering more would wind up.
const LARGEST_ERROR: i32 = STEP;

/// The feedback of past rounding errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NoiseShaper {
    /// Not at all: the code is rounded.
    Rounded,
    /// The last error: exact in the mean.
    #[default]
    FirstOrder,
    /// The last two errors: exact in the mean, and less noise at low frequencies for more at high ones.
    SecondOrder,
}

/// The state of a [`NoiseShaper`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoiseShaperState {
    /// The last error, in codes.
    last: i32,
    /// The one before.
    before: i32,
}

impl NoiseShaper {
    /// The 12-bit word for a 16-bit code, -2048..=2047 over minus to plus full scale.
    #[inline(always)]
    pub const fn step(self, state: &mut NoiseShaperState, code: DacCode) -> i16 {
        let carried = match self {
            Self::Rounded => 0,
            Self::FirstOrder => state.last,
            Self::SecondOrder => 2 * state.last - state.before,
        };
        let requested = code.0 as i32 + carried;
        let nearest = (requested + STEP / 2) >> MISSING_BITS;
        let word = clamp(nearest, LOWEST, HIGHEST);
        state.before = state.last;
        state.last = clamp(requested - word * STEP, -LARGEST_ERROR, LARGEST_ERROR);
        word as i16
    }
}

/// `i32::clamp`, which is not const.
const fn clamp(value: i32, low: i32, high: i32) -> i32 {
    if value < low {
        low
    } else if value > high {
        high
    } else {
        value
    }
}
