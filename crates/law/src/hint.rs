//! Hints for the compiler that not every supported one takes.

// Of 1.95; the build script asks for the version.
#[cfg(has_cold_path)]
#[allow(clippy::incompatible_msrv)]
pub(crate) use core::hint::cold_path;

/// A branch that is seldom taken; older compilers take no such hint, and the results are the same.
#[cfg(not(has_cold_path))]
#[inline(always)]
pub(crate) const fn cold_path() {}
