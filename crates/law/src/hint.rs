//! Hints for the compiler that not every supported one takes.

/// Marks the branch that it is in as seldom taken. Compilers before 1.95 take no such hint: the results are the same.
#[inline(always)]
// The build script asks for the version.
#[allow(clippy::incompatible_msrv)]
pub(crate) const fn cold_path() {
    #[cfg(has_cold_path)]
    core::hint::cold_path();
}
