//! Errors of the emulation.

use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// Reason why the firmware could not be emulated.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// The image cannot be read.
    #[error(
        "the image {} cannot be read: {source}; `cargo xtask build --board mps2` builds it",
        path.display()
    )]
    Image {
        /// Path that was read.
        path: PathBuf,
        source: io::Error,
    },
    /// The file is no image for an Arm microcontroller.
    #[error("{} is no image of the firmware: {reason}; give the ELF file of `cargo xtask build --board mps2`", path.display())]
    NoImage {
        path: PathBuf,
        /// Description of the fault.
        reason: String,
    },
    /// QEMU does not start.
    #[error(
        "cannot start qemu-system-arm: {0}; install QEMU's Arm system emulator (`cargo xtask setup` does it on Debian)"
    )]
    NotStarted(io::Error),
    /// A file or a process fails us.
    #[error("cannot {what}: {source}")]
    Io {
        /// Action that failed, in words.
        what: String,
        source: io::Error,
    },
    /// A job is larger than the shared memory's room for it.
    #[error("a job of {bytes} bytes, but there is room for {most}; shorten its motions")]
    JobTooLong {
        /// Its size in bytes.
        bytes: usize,
        /// Largest size in bytes.
        most: usize,
    },
    /// The content for the flash is of another size.
    #[error(
        "a flash of {bytes} bytes instead of {expected}; give a file that was left by --flash, or a new name"
    )]
    FlashSize {
        /// Its size in bytes.
        bytes: usize,
        /// Size of the flash. in bytes.
        expected: usize,
    },
    /// More ticks are asked than the shared memory has room for.
    #[error("{asked} ticks asked at once, but there is room for {room}; take answers first")]
    NoRoom {
        /// Ticks asked.
        asked: usize,
        /// Ticks that there is room for.
        room: usize,
    },
    /// The firmware ended before its first tick.
    #[error(
        "the firmware ended before its first tick; give the image of the emulated board, and of this release"
    )]
    EndedAtStart,
    /// The firmware does not answer.
    #[error(
        "the firmware has not answered tick {tick} within {waited:?}; on a computer that is not \
         overloaded this is a defect of the firmware"
    )]
    Silent {
        /// The tick, counted from the firmware's start.
        tick: u32,
        /// Time waited for it.
        waited: Duration,
    },
    /// The firmware ended with an error.
    #[error("the firmware failed; its last words:\n  {last_words}")]
    Failed {
        /// The log's last lines.
        last_words: String,
    },
}

impl EmulatorError {
    pub(super) fn io(what: impl Into<String>, source: io::Error) -> Self {
        Self::Io {
            what: what.into(),
            source,
        }
    }
}
