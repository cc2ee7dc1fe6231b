//! A file that keeps a flash's content when the machine is gone.

use std::io;
use std::path::{Path, PathBuf};

use quadrant_written::whole;

/// A file that keeps a flash's content: every byte as the flash reads, 0xFF where it is erased.
#[derive(Clone, Debug)]
pub struct FlashFile {
    path: PathBuf,
    kept: Vec<u8>,
}

impl FlashFile {
    /// Reads a file; one that is not there becomes an erased flash of `bytes` bytes.
    ///
    /// # Errors
    /// A file that cannot be read or written, or of another size.
    pub fn open(path: &Path, bytes: usize) -> io::Result<Self> {
        // A pipe or a terminal would be waited for.
        if std::fs::metadata(path).is_ok_and(|data| !data.is_file()) {
            let error = io::Error::other("it is no file");
            return Err(with_path(path, "cannot be read", &error));
        }
        let kept = match std::fs::read(path) {
            Ok(kept) => kept,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let erased = vec![0xFF; bytes];
                let mut file = Self {
                    path: path.to_owned(),
                    kept: Vec::new(),
                };
                // Before anything is to be stored, rather than then.
                file.keep(&erased)?;
                return Ok(file);
            }
            Err(error) => return Err(with_path(path, "cannot be read", &error)),
        };
        if kept.len() != bytes {
            return Err(io::Error::other(format!(
                "{} has {} bytes, a flash for settings {bytes}; give a file that --flash has left, or a new name",
                path.display(),
                kept.len(),
            )));
        }
        Ok(Self {
            path: path.to_owned(),
            kept,
        })
    }

    /// Returns the content that it keeps.
    pub fn content(&self) -> &[u8] {
        &self.kept
    }

    /// Keeps what the flash holds now. An interruption leaves the old or the new content.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn keep(&mut self, content: &[u8]) -> io::Result<()> {
        if self.kept == content {
            return Ok(());
        }
        whole::write(&self.path, content)
            .map_err(|error| with_path(&self.path, "cannot be written", &error))?;
        self.kept.clear();
        self.kept.extend(content);
        Ok(())
    }
}

fn with_path(path: &Path, what: &str, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{} {what}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_there_again_and_another_size_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("settings.flash");
        let mut file = FlashFile::open(&path, 8).unwrap();
        assert_eq!(file.content(), [0xFF; 8]);
        file.keep(&[1; 8]).unwrap();
        assert_eq!(FlashFile::open(&path, 8).unwrap().content(), [1; 8]);
        FlashFile::open(Path::new("/dev/zero"), 8).unwrap_err();
        let error = FlashFile::open(&path, 9).unwrap_err().to_string();
        assert!(
            error.contains("settings.flash has 8 bytes") && error.contains("9"),
            "{error}"
        );
    }
}
