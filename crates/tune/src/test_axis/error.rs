//! Reasons why a machine cannot be measured.

use std::error::Error;

use quadrant_settings::SettingsError;

/// Reason why a machine cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// Settings that are refused.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The connection failed, or the machine refused.
    #[error(transparent)]
    Connection(Box<dyn Error + Send + Sync>),
}
