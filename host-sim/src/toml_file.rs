//! Files of TOML: reading their text, and the errors that all of them have.

use std::fs::File;
use std::io::{self, Read};
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

/// Longest file, bytes: some twenty times what all settings take.
const MOST_BYTES: u64 = 1 << 20;

/// Reads a file's text.
///
/// # Errors
/// A file that cannot be read, or that is longer than any of settings: a device, say, that never ends.
pub(crate) fn text_of(path: &Path) -> Result<String, TomlFileError> {
    let read = || {
        let mut text = String::new();
        let mut file = File::open(path)?.take(MOST_BYTES + 1);
        if file.read_to_string(&mut text)? as u64 > MOST_BYTES {
            return Err(io::Error::new(
                io::ErrorKind::FileTooLarge,
                "it is longer than 1 MiB, and no file of settings or of a stage is",
            ));
        }
        Ok(text)
    };
    read().map_err(|source| TomlFileError::io(path, source))
}
