//! The memory shared with the emulated machine: a file that QEMU maps and that we read and write.

use std::fs::{File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use quadrant_lockstep::{BOOT, BootBlock, JOB, JOB_BYTES, MEMORY_BYTES, Mode};

use super::error::EmulatorError;

/// The shared memory. Dropping it removes the file.
#[derive(Debug)]
pub struct Memory {
    file: File,
    path: PathBuf,
}

/// A new file, in RAM where there is a file system in RAM: then it is never written to a disk.
fn create() -> Result<(File, PathBuf), EmulatorError> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let shared = Path::new("/dev/shm");
    let folder = if shared.is_dir() {
        shared.to_path_buf()
    } else {
        std::env::temp_dir()
    };
    let name = format!(
        "quadrant-{}-{}",
        std::process::id(),
        NUMBER.fetch_add(1, Ordering::Relaxed)
    );
    let path = folder.join(name);
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .create_new(true)
        .open(&path)
        .map_err(|source| EmulatorError::io(format!("create {}", path.display()), source))?;
    Ok((file, path))
}

/// A new file that goes away with its last user.
pub(super) fn unnamed() -> Result<File, EmulatorError> {
    let (file, path) = create()?;
    std::fs::remove_file(&path)
        .map_err(|source| EmulatorError::io(format!("remove {}", path.display()), source))?;
    Ok(file)
}

impl Memory {
    /// A new memory, all zero.
    ///
    /// # Errors
    /// No room for [`MEMORY_BYTES`].
    pub fn create() -> Result<Self, EmulatorError> {
        let (file, path) = create()?;
        let memory = Self { file, path };
        memory
            .file
            .set_len(MEMORY_BYTES as u64)
            .map_err(|source| EmulatorError::io("make room for the shared memory", source))?;
        Ok(memory)
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the boot block and the job it announces; an empty job leaves the firmware its defaults. `ticks` is the length
    /// of a recorded run, and 0 in lockstep.
    ///
    /// # Errors
    /// A job of more than [`JOB_BYTES`].
    pub fn prepare(&self, mode: Mode, ticks: u32, job: &[u8]) -> Result<(), EmulatorError> {
        if job.len() > JOB_BYTES {
            return Err(EmulatorError::JobTooLong {
                bytes: job.len(),
                most: JOB_BYTES,
            });
        }
        self.write(JOB, job)?;
        let block = BootBlock {
            mode,
            ticks,
            job_bytes: job.len() as u32,
        };
        self.write(BOOT, &block.encode())
    }

    /// Reads bytes; `offset` is one of [`quadrant_lockstep`]'s.
    ///
    /// # Errors
    /// The file fails.
    pub fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), EmulatorError> {
        self.file
            .read_exact_at(bytes, offset as u64)
            .map_err(|source| EmulatorError::io("read the shared memory", source))
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// The file fails.
    pub fn write(&self, offset: usize, bytes: &[u8]) -> Result<(), EmulatorError> {
        self.file
            .write_all_at(bytes, offset as u64)
            .map_err(|source| EmulatorError::io("write the shared memory", source))
    }

    /// Reads a word.
    ///
    /// # Errors
    /// The file fails.
    pub fn word(&self, offset: usize) -> Result<u32, EmulatorError> {
        let mut bytes = [0; 4];
        self.read(offset, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Writes a word.
    ///
    /// # Errors
    /// The file fails.
    pub fn set_word(&self, offset: usize, word: u32) -> Result<(), EmulatorError> {
        self.write(offset, &word.to_le_bytes())
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // Nothing more can be done about a file that does not go away.
        let _ = std::fs::remove_file(&self.path);
    }
}
