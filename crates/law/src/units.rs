//! The typed edges of the control law: counts in, codes out, and positions exact to far below a nanometre.
//!
//! A position is never held as a float. [`Position`] is an `i64` of encoder counts with 16 fraction bits, so that a
//! reference does not drift however long it runs, and the tracking error is formed before anything is rounded.

use crate::hint::cold_path;
use core::ops::{Add, Neg, Sub};

use crate::rounding;

/// Number of fraction bits of [`Position`]: one unit is 2^-16 encoder count (7.6 pm at 0.5 um per count).
pub const POSITION_FRACTION_BITS: u32 = 16;

/// Units of [`Position`] per encoder count, 2^16.
pub const POSITION_UNITS_PER_COUNT: f64 = 65536.0;

/// Largest velocity that a reference may be allowed, mm/s.
pub const FASTEST_MM_S: f64 = 1e3;

/// A position or a displacement in 2^-16 encoder counts. It holds +-1.4e14 counts, 70 000 km of half micrometres: sums
/// and differences of what a machine can reach do not wrap, and the encoder's own sum saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position(pub i64);

impl Position {
    /// The origin of the axis.
    pub const ZERO: Self = Self(0);

    /// The displacement of a step of an encoder; never saturates.
    pub(crate) const fn from_step(counts: i32) -> Self {
        Self((counts as i64) << POSITION_FRACTION_BITS)
    }

    /// The sum, saturating: for what adds up without end.
    #[inline(always)]
    pub const fn saturating_add(self, other: Self) -> Self {
        match self.0.checked_add(other.0) {
            Some(sum) => Self(sum),
            None => {
                cold_path();
                Self(self.0.saturating_add(other.0))
            }
        }
    }

    /// Rounds `value_mm` to the nearest unit; `resolution_mm` is the length of one encoder count. Settings time only.
    #[inline(never)]
    pub fn from_mm(value_mm: f64, resolution_mm: f64) -> Self {
        Self(rounding::round(value_mm / resolution_mm * POSITION_UNITS_PER_COUNT) as i64)
    }

    /// The position in mm; `resolution_mm` is the length of one encoder count. For people and files, not for the tick.
    pub fn to_mm(self, resolution_mm: f64) -> f64 {
        self.0 as f64 / POSITION_UNITS_PER_COUNT * resolution_mm
    }

    /// This displacement clipped to the range of an `i32` (+-32767 counts): how far an axis moves in one tick.
    #[inline(always)]
    pub const fn clipped(self) -> i32 {
        let low = self.0 as i32;
        if low as i64 == self.0 {
            return low;
        }
        cold_path();
        if self.0 < 0 { i32::MIN } else { i32::MAX }
    }
}

impl Add for Position {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

impl Sub for Position {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }
}

impl Neg for Position {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.wrapping_neg())
    }
}

/// An encoder's count after accumulation: as wide as any machine will travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct EncoderCount(pub i64);

impl EncoderCount {
    /// The count as a position; saturates beyond what a [`Position`] holds.
    pub const fn position(self) -> Position {
        Position(self.0.saturating_mul(1 << POSITION_FRACTION_BITS))
    }
}

/// The word of a 16-bit two's-complement converter, -32768..=32767 over minus to plus full scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DacCode(pub i16);

impl DacCode {
    /// Zero volts before the amplifier's offset is taken into account.
    pub const ZERO: Self = Self(0);

    /// Codes per unit of full scale: the largest code stands for plus full scale.
    pub const FULL_SCALE: f64 = 32767.0;

    /// The code of a value already in codes, saturating at both ends.
    pub const fn saturating(code: i32) -> Self {
        if code > i16::MAX as i32 {
            Self(i16::MAX)
        } else if code < i16::MIN as i32 {
            Self(i16::MIN)
        } else {
            Self(code as i16)
        }
    }

    /// The nearest code of a voltage on a converter of +-`full_scale_v`, saturating at both ends; a voltage that is no
    /// number is zero. Settings time and host only.
    ///
    /// ```
    /// use quadrant_law::units::DacCode;
    ///
    /// assert_eq!(DacCode::from_volts(2.5, 10.0), DacCode(8192));
    /// assert_eq!(DacCode::from_volts(-12.0, 10.0), DacCode(-32768));
    /// assert!((DacCode(8192).to_volts(10.0) - 2.5).abs() < 0.5 * 10.0 / DacCode::FULL_SCALE);
    /// ```
    pub fn from_volts(volts: f64, full_scale_v: f64) -> Self {
        Self::saturating(rounding::round(volts / full_scale_v * Self::FULL_SCALE) as i32)
    }

    /// The code in volts on a converter of +-`full_scale_v`. Settings time and host only.
    pub const fn to_volts(self, full_scale_v: f64) -> f64 {
        self.0 as f64 / Self::FULL_SCALE * full_scale_v
    }
}
