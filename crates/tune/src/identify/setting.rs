//! A setting of a measurement or a fit that cannot be.

/// A setting that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{field} = {value}: {expected}")]
pub struct SettingError {
    pub field: &'static str,
    pub value: f64,
    pub expected: &'static str,
}
