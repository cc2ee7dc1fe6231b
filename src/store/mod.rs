//! The settings in flash: stored whole or not at all.
//!
//! ```text
//!   StageSettings  --encode-->  bytes, every value under its path  --append-->  two sectors of the flash
//! ```
//!
//! A set is one item. It is written beside the newest one and takes its place only when it is complete, so that a power
//! cut at any flash operation leaves the old set or the new one. Sets of other versions are read as far as they are
//! understood: what is unknown is skipped and what is missing has its default, both are reported, and a value that this
//! firmware refuses refuses the whole set. See `docs/settings-storage.md`.
//!
//! Everything here blocks for as long as the flash takes, and belongs into the lowest task.

mod decode;
mod encode;
mod format;
mod log;
mod provenance;
mod sector;

pub use decode::{DecodeError, Finding, decode};
pub use encode::{TooLong, encode};
pub use format::FORMAT;
pub use log::{LogError, Stored};
pub use provenance::{PROVENANCE_BYTES, Provenance};

use core::fmt;

use crate::hal::SettingsFlash;
use log::{Log, Newest, SEQUENCE_BYTES};
use quadrant_settings::{SettingsError, StageSettings};

/// Room for one set while it is written or read; a test fills it with the longest.
pub const BUFFER_BYTES: usize = 7 * 1024;

/// Reason why settings were not stored.
#[derive(Clone, Debug, PartialEq)]
pub enum SaveError<E> {
    /// They are not valid.
    Refused(SettingsError),
    /// They do not fit into the buffer.
    TooLong,
    /// The flash; the set that was stored last is still there.
    Log(LogError<E>),
}

/// Reason why stored settings were not adopted. They stay where they are, and the settings are the default ones.
#[derive(Clone, Debug, PartialEq)]
pub enum LoadError<E> {
    /// They are not understood, or not valid.
    Decode(DecodeError),
    /// The flash.
    Log(LogError<E>),
}

impl<E: fmt::Debug> fmt::Display for SaveError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(error) => error.fmt(f),
            Self::TooLong => write!(f, "the settings take more than {BUFFER_BYTES} bytes"),
            Self::Log(error) => error.fmt(f),
        }
    }
}

impl<E: fmt::Debug> fmt::Display for LoadError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Decode(error) => error.fmt(f),
            Self::Log(error) => error.fmt(f),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for SaveError<E> {}
impl<E: fmt::Debug> core::error::Error for LoadError<E> {}

/// Number and origin of a stored set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Number of sets stored so far, this one included.
    pub sequence: u32,
    /// Its origin.
    pub provenance: Provenance,
    /// True if nothing is stored that could be a newer set, damaged or cut short: only then may this one be put in force
    /// unasked.
    pub is_newest: bool,
}

/// The settings in two sectors of a flash, each of the flash's erase size.
#[derive(Clone, Debug)]
pub struct Store<F> {
    log: Log<F>,
}

impl<F: SettingsFlash> Store<F> {
    /// The two sectors from offset `start` on, a multiple of the erase size.
    pub fn new(flash: F, start: u32) -> Self {
        Self {
            log: Log::new(flash, start),
        }
    }

    /// The flash.
    pub const fn flash(&self) -> &F {
        &self.log.flash
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.log.flash
    }

    /// Stores settings, with where they come from and `elements` the room for GMS elements.
    ///
    /// # Errors
    /// Settings that are not valid, or a flash that fails; what was stored before is still there.
    pub fn save(
        &mut self,
        settings: &StageSettings,
        elements: usize,
        provenance: &Provenance,
        buffer: &mut [u8; BUFFER_BYTES],
    ) -> Result<Stored, SaveError<F::Error>> {
        settings.validate(elements).map_err(SaveError::Refused)?;
        let fill = |buffer: &mut [u8], sequence: u32| {
            let (head, body) = buffer
                .split_first_chunk_mut::<SEQUENCE_BYTES>()
                .ok_or(TooLong)?;
            *head = sequence.to_le_bytes();
            Ok(SEQUENCE_BYTES + encode(settings, provenance, body)?)
        };
        match self.log.write(buffer, fill) {
            Ok(stored) => stored.map_err(SaveError::Log),
            Err(TooLong) => Err(SaveError::TooLong),
        }
    }

    /// Reads the newest settings that can be read; `None`, and the default ones, if the flash is blank. `report` receives what
    /// of them this firmware does not know, and what they lack. See [`Loaded::is_newest`].
    ///
    /// # Errors
    /// A stored set that is refused, a flash that is not blank and of which nothing can be read, or one that fails;
    /// `settings` are the default ones then.
    pub fn load(
        &mut self,
        settings: &mut StageSettings,
        elements: usize,
        buffer: &mut [u8; BUFFER_BYTES],
        report: &mut dyn FnMut(Finding<'_>),
    ) -> Result<Option<Loaded>, LoadError<F::Error>> {
        let Newest { place, is_certain } = match self.log.read(buffer) {
            Ok(Some(newest)) => newest,
            none => {
                settings.set_default();
                return none.map(|_| None).map_err(LoadError::Log);
            }
        };
        let item = buffer.get(SEQUENCE_BYTES..place.length).unwrap_or_default();
        let provenance = decode(item, elements, settings, report).map_err(LoadError::Decode)?;
        Ok(Some(Loaded {
            sequence: place.sequence,
            provenance,
            is_newest: is_certain,
        }))
    }
}
