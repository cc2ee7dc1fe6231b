//! Reasons why the flash for settings refuses.

use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};

/// The flash did not carry out its command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FlashError {
    /// Outside of the two sectors.
    OutOfBounds,
    /// Not at a word, or not at a sector.
    NotAligned,
    /// The controller's error flags (FLASH_SR).
    Controller(u32),
    /// It did not end in time.
    Stuck,
    /// It reads back differently: the cells are worn.
    Verify,
    /// The amplifiers' enable line is high.
    OutputsOn,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            Self::Controller(_) | Self::Stuck | Self::Verify | Self::OutputsOn => {
                NorFlashErrorKind::Other
            }
        }
    }
}

impl From<NorFlashErrorKind> for FlashError {
    fn from(kind: NorFlashErrorKind) -> Self {
        match kind {
            NorFlashErrorKind::NotAligned => Self::NotAligned,
            _ => Self::OutOfBounds,
        }
    }
}
