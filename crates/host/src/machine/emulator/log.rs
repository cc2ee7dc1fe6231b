//! The emulated firmware's log.
//!
//! QEMU writes them to a file, not a pipe: so they can be read at any time without waiting, and all that the firmware has
//! written is there.

use std::fmt;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::sync::Arc;

use defmt_decoder::Table;

use super::error::EmulatorError;
use super::memory;
use crate::log::decode;

/// Byte that ends a frame.
const DELIMITER: u8 = 0;

/// Reader of the firmware's log.
pub(super) struct Log {
    file: File,
    read: u64,
    table: Arc<Table>,
    /// The beginning of a frame.
    begun: Vec<u8>,
}

impl Log {
    /// An empty log, and the file that the emulator is to write to.
    pub(super) fn create(table: Arc<Table>) -> Result<(Self, File), EmulatorError> {
        let file = memory::unnamed()?;
        let output = file
            .try_clone()
            .map_err(|source| EmulatorError::io("share the log's file", source))?;
        let log = Self {
            file,
            read: 0,
            table,
            begun: Vec::new(),
        };
        Ok((log, output))
    }

    /// The lines that have come since the last call.
    pub(super) fn read(&mut self) -> Result<Vec<String>, EmulatorError> {
        let mut buffer = [0; 4096];
        loop {
            let length = self
                .file
                .read_at(&mut buffer, self.read)
                .map_err(|source| EmulatorError::io("read the firmware's log", source))?;
            if length == 0 {
                break;
            }
            self.read += length as u64;
            self.begun.extend(&buffer[..length]);
        }
        let Some(last) = self.begun.iter().rposition(|&byte| byte == DELIMITER) else {
            return Ok(Vec::new());
        };
        let rest = self.begun.split_off(last + 1);
        let whole = std::mem::replace(&mut self.begun, rest);
        Ok(decode(&self.table, &whole))
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Log")
            .field("read", &self.read)
            .finish_non_exhaustive()
    }
}
