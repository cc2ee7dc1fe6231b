//! The settings that runs on the simulated stage start from.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::experiment::run_configuration::identified_settings;
use quadrant_sim::settings_file::{SettingsFile, SettingsFileError};

/// Option that names the settings of the simulated stage's control law.
#[derive(Clone, Debug, Default, Args)]
pub struct LawSettings {
    /// Settings of the control law, as `quadrant commission` leaves them; without them, those that commissioning the
    /// simulated stage gave, or gives of a stage of your own.
    #[arg(id = "settings", long, value_name = "FILE")]
    pub path: Option<PathBuf>,
}

impl LawSettings {
    /// Reads the settings.
    ///
    /// # Errors
    /// A file that cannot be read, or settings that the firmware would refuse.
    pub fn read(&self) -> Result<SettingsFile, SettingsFileError> {
        match &self.path {
            Some(path) => SettingsFile::read(path),
            None => identified_settings(),
        }
    }

    /// Returns the option as a command line repeats it, with a space before it; empty without a file.
    pub fn option(&self) -> String {
        let option = |path: &PathBuf| format!(" --settings {}", path.display());
        self.path.as_ref().map_or_else(String::new, option)
    }
}
