//! The memory shared with the emulated machine: a file that QEMU maps and that we read and write.

use std::fs::{File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::{Context, Result, ensure};
use quadrant::link::lockstep::{BOOT, BootBlock, JOB, JOB_BYTES, MEMORY_BYTES, Mode};

/// The shared memory. Dropping it removes the file.
pub(crate) struct Memory {
    file: File,
    path: PathBuf,
}

impl Memory {
    /// A new memory, all zero.
    pub(crate) fn create() -> Result<Self> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        // A file system in RAM, where there is one: the file is never written to a disk then.
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
            .with_context(|| format!("cannot create {}", path.display()))?;
        let memory = Self { file, path };
        memory
            .file
            .set_len(MEMORY_BYTES as u64)
            .context("cannot make room for the shared memory")?;
        Ok(memory)
    }

    /// Where the file is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the boot block and the job it announces.
    pub(crate) fn prepare(&self, mode: Mode, ticks: u32, job: &[u8]) -> Result<()> {
        ensure!(
            job.len() <= JOB_BYTES,
            "a job of {} bytes, but there is room for {JOB_BYTES}",
            job.len()
        );
        self.write(JOB, job)?;
        let block = BootBlock {
            mode,
            ticks,
            job_bytes: u32::try_from(job.len())?,
        };
        self.write(BOOT, &block.encode())
    }

    /// Reads bytes.
    pub(crate) fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<()> {
        self.file
            .read_exact_at(bytes, offset as u64)
            .context("cannot read the shared memory")
    }

    /// Writes bytes.
    pub(crate) fn write(&self, offset: usize, bytes: &[u8]) -> Result<()> {
        self.file
            .write_all_at(bytes, offset as u64)
            .context("cannot write the shared memory")
    }

    /// Reads a word.
    pub(crate) fn word(&self, offset: usize) -> Result<u32> {
        let mut bytes = [0; 4];
        self.read(offset, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Writes a word.
    pub(crate) fn set_word(&self, offset: usize, word: u32) -> Result<()> {
        self.write(offset, &word.to_le_bytes())
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // Nothing more can be done about a file that does not go away.
        let _ = std::fs::remove_file(&self.path);
    }
}
