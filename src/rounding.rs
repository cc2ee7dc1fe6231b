//! libm's rounding, each function once in the image: they are small enough to be copied to every call, and double precision
//! without hardware makes 200 bytes of each copy. Settings time only.

/// The nearest whole number; halves are rounded away from zero.
#[inline(never)]
pub(crate) fn round(value: f64) -> f64 {
    libm::round(value)
}

/// The largest whole number not above `value`.
#[inline(never)]
pub(crate) fn floor(value: f64) -> f64 {
    libm::floor(value)
}

/// The smallest whole number not below `value`.
#[inline(never)]
pub(crate) fn ceil(value: f64) -> f64 {
    libm::ceil(value)
}
