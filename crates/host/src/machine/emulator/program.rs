//! An image for the emulated board.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use defmt_decoder::Table;
use object::read::elf::FileHeader;
use object::{Endianness, elf};

use super::error::EmulatorError;
use crate::log;

/// A linked image, read.
#[derive(Clone)]
pub struct Program {
    path: PathBuf,
    machine: &'static str,
    /// The strings of its log.
    table: Arc<Table>,
}

impl Program {
    /// Reads an image, and finds out for which machine it is: with a floating-point unit (Cortex-M4F) or without (Cortex-M3).
    ///
    /// # Errors
    /// No such file, or none for an Arm microcontroller.
    pub fn read(path: &Path) -> Result<Self, EmulatorError> {
        let elf = std::fs::read(path).map_err(|source| EmulatorError::Image {
            path: path.to_owned(),
            source,
        })?;
        let no_image = |reason: String| EmulatorError::NoImage {
            path: path.to_owned(),
            reason,
        };
        let header = elf::FileHeader32::<Endianness>::parse(&*elf)
            .map_err(|error| no_image(error.to_string()))?;
        let endian = header
            .endian()
            .map_err(|error| no_image(error.to_string()))?;
        if header.e_machine(endian) != elf::EM_ARM {
            return Err(no_image("it is not for an Arm processor".to_owned()));
        }
        let hard_float = header.e_flags(endian) & elf::EF_ARM_ABI_FLOAT_HARD != 0;
        let table = log::table(&elf).map_err(no_image)?;
        Ok(Self {
            path: path.to_owned(),
            table: Arc::new(table),
            machine: if hard_float {
                "mps2-an386"
            } else {
                "mps2-an385"
            },
        })
    }

    /// Returns the path of the image.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// QEMU's name of the machine that it is for.
    pub const fn machine(&self) -> &'static str {
        self.machine
    }

    /// The lines of a log that was read out of a machine's memory: whole frames.
    pub fn decode_log(&self, frames: &[u8]) -> Vec<String> {
        log::decode(&self.table, frames)
    }

    /// The strings of its log.
    pub(super) fn table(&self) -> Arc<Table> {
        Arc::clone(&self.table)
    }
}

impl std::fmt::Debug for Program {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Program")
            .field("path", &self.path)
            .field("machine", &self.machine)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_image_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("none.elf");
        let error = Program::read(&missing).unwrap_err().to_string();
        assert!(
            error.contains("none.elf") && error.contains("cargo xtask build"),
            "{error}"
        );
        let text = folder.path().join("text.elf");
        std::fs::write(&text, "not an image").unwrap();
        let error = Program::read(&text).unwrap_err().to_string();
        assert!(error.contains("text.elf is no image"), "{error}");
    }
}
