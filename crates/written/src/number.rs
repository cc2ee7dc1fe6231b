//! Numbers as a person reads them.

use std::fmt;

/// A number with four significant digits, and no more of them than it needs.
#[derive(Clone, Copy, Debug)]
pub struct Brief(pub f64);

impl fmt::Display for Brief {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match format!("{:.3e}", self.0).parse::<f64>() {
            Ok(rounded) => write!(f, "{}", rounded + 0.0),
            Err(_) => write!(f, "{}", self.0),
        }
    }
}

/// Returns a number with so many digits after its point, and without a sign where nothing but zeros would follow it.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|b| b == b'0' || b == b'.') => digits.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::{Brief, fixed};

    #[test]
    fn rounding_leaves_neither_a_tail_nor_a_sign_of_nothing() {
        assert_eq!(Brief(1.000_000_000_000_000_2).to_string(), "1");
        assert_eq!(Brief(1.0 / 3.0).to_string(), "0.3333");
        assert_eq!(Brief(-0.0).to_string(), "0");
        assert_eq!(Brief(f64::INFINITY).to_string(), "inf");
        assert_eq!(fixed(-0.000_4, 3), "0.000");
        assert_eq!(fixed(-0.000_6, 3), "-0.001");
        assert_eq!(fixed(-0.0, 0), "0");
        assert_eq!(fixed(f64::NAN, 2), "NaN");
    }
}
