//! The settings that commissioning the simulated stage gave.

use std::path::Path;

use crate::settings_file::{SettingsFile, SettingsFileError};

/// The stage as `quadrant commission` found it, on x, then y, then z; a test commissions it again and compares.
const IDENTIFIED: &str = include_str!("../data/identified-stage.toml");

/// The settings that commissioning the simulated stage gave.
///
/// # Errors
/// Settings that this version refuses.
pub fn identified_settings() -> Result<SettingsFile, SettingsFileError> {
    SettingsFile::parse(IDENTIFIED, Path::new("host-sim/data/identified-stage.toml"))
}
