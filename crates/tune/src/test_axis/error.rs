//! Reasons why a machine cannot be measured.

use std::error::Error;

use quadrant_settings::SettingsError;

/// Reason why a machine cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// Settings that are refused.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The control law alone has no flash.
    #[error("the control law alone has no flash to store settings in: take another --machine")]
    NoFlash,
    /// The connection failed, or the machine refused.
    #[error(transparent)]
    Connection(Box<dyn Error + Send + Sync>),
}
