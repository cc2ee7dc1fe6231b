//! Numbers in messages, as decimals of twelve digits.
//!
//! `core`'s shortest and exact decimals take 14 KB of a firmware's flash and 2 KB of its stack. A message needs neither:
//! it shows a value that a person wrote, or a limit.

use core::fmt::{self, Write as _};

use crate::rounding;

/// A number to be shown: with up to twelve significant digits, or with as many decimals as the format asks for
/// (`{:.3}`), if that is not more than 15 digits in all. From 1e15 on and below 1e-7 it has an exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decimal(pub f64);

/// Significant digits: enough to distinguish a count of 2^32 from the next.
const DIGITS: i32 = 12;
/// Place of the first digit up to which numbers have an exponent; with all digits, 10^18 is the unit then.
const MAX_SMALL_EXPONENT: i32 = -7;
/// Place of the first digit from which on numbers have an exponent: 1e15.
const MIN_LARGE_EXPONENT: i32 = 15;

/// 10 to a whole power, by multiplying: exact up to 22.
#[inline(never)]
fn power_of_ten(exponent: i32) -> f64 {
    let mut power = 1.0;
    for _ in 0..exponent.unsigned_abs().min(330) {
        power *= 10.0;
    }
    power
}

/// Returns `value * 10^exponent`.
#[inline(never)]
fn scaled(value: f64, exponent: i32) -> f64 {
    match exponent {
        // Nothing that is not 0 has a smaller power, and 10^330 is no number.
        ..-300 => value / power_of_ten(300) / power_of_ten(-300 - exponent),
        -300..0 => value / power_of_ten(-exponent),
        0..=300 => value * power_of_ten(exponent),
        301.. => value * power_of_ten(300) * power_of_ten(exponent - 300),
    }
}

/// Writes `digits * 10^-decimals`.
fn write_fixed(f: &mut fmt::Formatter<'_>, digits: u64, decimals: u32) -> fmt::Result {
    let unit = 10u64.pow(decimals);
    write!(f, "{}", digits / unit)?;
    if decimals > 0 {
        f.write_char('.')?;
        let mut rest = digits % unit;
        let mut place = unit;
        for _ in 0..decimals {
            place /= 10;
            // One digit at a time: a width that is not known to the compiler takes more code.
            f.write_char(char::from(b'0' + (rest / place) as u8))?;
            rest %= place;
        }
    }
    Ok(())
}

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = libm::fabs(self.0);
        if self.0.is_nan() {
            return f.write_str("NaN");
        }
        if self.0.is_sign_negative() {
            f.write_char('-')?;
        }
        if magnitude.is_infinite() {
            return f.write_str("inf");
        }
        if let Some(decimals) = f.precision() {
            let decimals = decimals.min(MIN_LARGE_EXPONENT as usize);
            let digits = rounding::round(scaled(magnitude, decimals as i32));
            if digits < 1e15 {
                return write_fixed(f, digits as u64, decimals as u32);
            }
        }
        if magnitude == 0.0 {
            return f.write_char('0');
        }
        // The place of the first digit from the power of two, by log10(2); it may be off by one, either way.
        let (_, power) = libm::frexp(magnitude);
        let mut first = ((power - 1) * 30_103).div_euclid(100_000);
        let mut digits = rounding::round(scaled(magnitude, DIGITS - 1 - first)) as u64;
        if digits < 10u64.pow(DIGITS as u32 - 1) {
            first -= 1;
            digits = rounding::round(scaled(magnitude, DIGITS - 1 - first)) as u64;
        }
        if digits >= 10u64.pow(DIGITS as u32) {
            first += 1;
            digits = rounding::round(scaled(magnitude, DIGITS - 1 - first)) as u64;
        }
        let mut decimals = DIGITS - 1;
        let exponent = !(MAX_SMALL_EXPONENT..MIN_LARGE_EXPONENT).contains(&first);
        if !exponent {
            decimals -= first;
        }
        while digits.is_multiple_of(10) && decimals > 0 {
            digits /= 10;
            decimals -= 1;
        }
        for _ in decimals..0 {
            digits *= 10;
        }
        write_fixed(f, digits, decimals.max(0) as u32)?;
        if exponent {
            write!(f, "e{first}")?;
        }
        Ok(())
    }
}
