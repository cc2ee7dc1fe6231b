//! Reasons why a settings file cannot be used.

use std::path::PathBuf;

use quadrant_settings::SettingsError;

use crate::toml_file::TomlFileError;

/// Form of the file; a file of another form is refused.
pub(super) const FORM: u32 = 1;

/// Reason why a settings file cannot be used, or written.
#[derive(Debug, thiserror::Error)]
pub enum SettingsFileError {
    /// The file cannot be read or written, is no TOML, or has no settings.
    #[error(transparent)]
    File(#[from] TomlFileError),
    /// It has a setting that there is not.
    #[error("{}: line {line}: there is no setting {setting}; did you mean {meant}?", path.display())]
    Unknown {
        /// Path of the file.
        path: PathBuf,
        /// Line of the setting.
        line: usize,
        /// Its path.
        setting: String,
        /// The most similar setting.
        meant: String,
    },
    /// A value is of the wrong type, or no name that the setting may have.
    #[error("{}: line {line}: {setting}: {reason}", path.display())]
    Type {
        /// Path of the file.
        path: PathBuf,
        /// Line of the setting.
        line: usize,
        /// Its path.
        setting: String,
        /// The value found, and the kind that is expected.
        reason: String,
    },
    /// It cannot be expressed as TOML.
    #[error("{}: {source}", path.display())]
    Serialise {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: toml::ser::Error,
    },
    /// It is of a form that this program does not know.
    #[error("{}: form {form} of the settings file; this program reads form {FORM}", path.display())]
    Form {
        /// Path of the file.
        path: PathBuf,
        /// Form that the file names.
        form: u32,
    },
    /// It has more axes than a stage.
    #[error("{}: {count} times [[stage.axes]]; a stage has x, y and z", path.display())]
    Axes {
        /// Path of the file.
        path: PathBuf,
        /// Number of axes that the file has.
        count: usize,
    },
    /// A value is refused.
    #[error("{}: {source}", path.display())]
    Refused {
        /// Path of the file.
        path: PathBuf,
        /// The field and what is allowed.
        source: SettingsError,
    },
}
