//! The load of motor and amplifier: I²t.
//!
//! An amplifier's output is a force, so a current: the heat that it brings goes with the square of the output. The part
//! beyond the output that the motor withstands indefinitely is summed, a part below is taken from the sum, which never falls below
//! nothing. In converter's words, so that all number types find the same.

use crate::rounding;

/// Ticks between two looks at an axis: those of [`is_due`](super::plausibility::is_due).
const LOOK_TICKS: f64 = super::plausibility::DUE_TICKS as f64;

/// Watches the load of an axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overload {
    /// Square of the word that the motor withstands indefinitely.
    continuous: i64,
    /// Sum of squares beyond it that is a fault; the largest number for none.
    budget: i64,
    offset: i32,
}

/// The squares of words, beyond the one that the motor withstands indefinitely, that the motor has not got rid of yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OverloadState(i64);

impl Overload {
    /// A load that is not watched.
    pub const UNLIMITED: Self = Self {
        continuous: i64::MAX,
        budget: i64::MAX,
        offset: 0,
    };

    /// A motor that withstands `continuous` (converter's words, not negative) indefinitely and `largest` for `overload_s` (s), with
    /// no force at the word `offset`; it is not watched if it withstands the largest indefinitely. Settings time only.
    pub fn new(continuous: f64, largest: f64, overload_s: f64, offset: i32, period_s: f64) -> Self {
        if continuous >= largest {
            return Self::UNLIMITED;
        }
        let beyond = largest * largest - continuous * continuous;
        Self {
            continuous: rounding::round(continuous * continuous) as i64,
            budget: rounding::round(beyond * overload_s / (period_s * LOOK_TICKS)) as i64,
            offset,
        }
    }

    /// Takes the word that is put out; returns true if the motor withstands it.
    #[inline(always)]
    pub fn step(&self, state: &mut OverloadState, word: i16) -> bool {
        let force = i64::from(i32::from(word) - self.offset);
        // Neither is negative: their difference does not overflow.
        let sum = (state.0 + force * force).wrapping_sub(self.continuous);
        if sum < 0 {
            state.0 = 0;
            return true;
        }
        state.0 = sum.min(self.budget);
        sum <= self.budget
    }
}
