//! Rounding and clamping at settings time, each function once in the image. libm's are small enough to be copied to every
//! call, and double precision without hardware makes 200 bytes of each copy.

/// The nearest whole number; halves are rounded away from zero.
#[inline(never)]
pub fn round(value: f64) -> f64 {
    libm::round(value)
}

/// The largest whole number not above `value`.
#[inline(never)]
pub fn floor(value: f64) -> f64 {
    libm::floor(value)
}

/// The smallest whole number not below `value`.
#[inline(never)]
pub fn ceil(value: f64) -> f64 {
    libm::ceil(value)
}

/// `value` within `least..=most`, which must be ordered; no number stays none. `f64::clamp` would want to print its bounds,
/// should they be out of order, and that takes 10 KB.
#[inline(never)]
pub fn clamp(value: f64, least: f64, most: f64) -> f64 {
    if value < least {
        least
    } else if value > most {
        most
    } else {
        value
    }
}
