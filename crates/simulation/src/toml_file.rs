//! Files of TOML: reading their text, and the errors that all of them have.

use std::path::{Path, PathBuf};

/// Reason why the text of a file cannot be read, written or understood.
#[derive(Debug, thiserror::Error)]
pub enum TomlFileError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// It is no TOML, lacks what it must have, or has a name or a type that is not known.
    #[error("{}: {source}", path.display())]
    Syntax {
        /// Path of the file.
        path: PathBuf,
        /// Line and cause.
        source: Box<toml::de::Error>,
    },
}

impl TomlFileError {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn syntax(path: &Path, source: toml::de::Error) -> Self {
        Self::Syntax {
            path: path.to_owned(),
            source: Box::new(source),
        }
    }
}

/// Reads a file's text.
///
/// # Errors
/// A file that cannot be read.
pub(crate) fn text_of(path: &Path) -> Result<String, TomlFileError> {
    std::fs::read_to_string(path).map_err(|source| TomlFileError::io(path, source))
}
