//! A setting of a measurement or a fit that cannot be.

/// A setting that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{field} = {value}: {expected}")]
pub struct SettingError {
    /// Which.
    pub field: &'static str,
    /// What it is.
    pub value: f64,
    /// What it must be.
    pub expected: &'static str,
}
