//! A flash of two sectors that loses its power in the middle of things.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

use quadrant::hal::SettingsFlash;

use crate::noise::Noise;

/// Bytes of a sector, as on the reference board.
pub const SECTOR: usize = 16 * 1024;

/// The remains of an operation that a cut falls into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// It has not begun.
    Nothing,
    /// The lower half of the word or sector is done.
    LowHalf,
    /// The upper half is done.
    HighHalf,
    /// Some bits are done and some are not.
    SomeBits(u64),
    /// It is done, and nothing after it.
    All,
}

impl Damage {
    pub fn each(seed: u64) -> [Self; 5] {
        [
            Self::Nothing,
            Self::LowHalf,
            Self::HighHalf,
            Self::SomeBits(seed),
            Self::All,
        ]
    }

    /// Moves the bytes from what they hold towards `to`, as far as the operation got.
    fn apply(self, bytes: &mut [u8], to: &[u8]) {
        let half = bytes.len() / 2;
        match self {
            Self::Nothing => {}
            Self::LowHalf => bytes[..half].copy_from_slice(&to[..half]),
            Self::HighHalf => bytes[half..].copy_from_slice(&to[half..]),
            Self::SomeBits(seed) => {
                let mut noise = Noise::new(seed);
                for (byte, to) in bytes.iter_mut().zip(to) {
                    let done = (noise.bits() >> 20) as u8;
                    *byte = (*byte & !done) | (to & done);
                }
            }
            Self::All => bytes.copy_from_slice(to),
        }
    }
}

/// Sectors, two unless there are to be more, written by words, each word once between erasures. Words of more than eight bytes have a
/// check sum: one that a cut left in between reads as zeros.
#[derive(Clone, Debug)]
pub struct WordFlash<const WORD: usize> {
    pub bytes: Vec<u8>,
    programmed: Vec<bool>,
    torn: Vec<bool>,
    /// Words written and sectors erased so far.
    pub operations: u64,
    /// Erasures of each sector.
    pub erasures: Vec<u32>,
    /// The operation that the power fails in, and what becomes of it.
    pub cut: Option<(u64, Damage)>,
    /// Words whose bits do not change any more.
    pub worn: Option<std::ops::Range<usize>>,
    /// Words that read as blank and take no write: a cut may leave such.
    pub refusing: Option<std::ops::Range<usize>>,
    /// The amplifiers' enable line is high.
    pub outputs_on: bool,
}

/// A flash as the reference board's, with words of four bytes.
pub type Flash = WordFlash<4>;

impl<const WORD: usize> Default for WordFlash<WORD> {
    fn default() -> Self {
        Self::of_sectors(2)
    }
}

/// The answer of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// There is no power.
    Off,
    /// The operation is not allowed.
    Refused(NorFlashErrorKind),
    /// The word has been written since it was erased.
    WrittenTwice,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Refused(kind) => *kind,
            Self::Off | Self::WrittenTwice => NorFlashErrorKind::Other,
        }
    }
}

impl<const WORD: usize> WordFlash<WORD> {
    /// A blank flash of so many sectors.
    pub fn of_sectors(count: usize) -> Self {
        Self {
            bytes: vec![0xFF; count * SECTOR],
            programmed: vec![false; count * SECTOR / WORD],
            torn: vec![false; count * SECTOR / WORD],
            operations: 0,
            erasures: vec![0; count],
            cut: None,
            worn: None,
            refusing: None,
            outputs_on: false,
        }
    }

    /// True if the power has failed.
    pub fn is_off(&self) -> bool {
        self.cut.is_some_and(|(cut, _)| self.operations > cut)
    }

    /// The power comes back.
    pub fn reboot(mut self) -> Self {
        self.cut = None;
        self
    }

    /// One operation on `bytes[at..]`; the power may fail in it, and is off after that.
    fn operate(&mut self, at: usize, to: &[u8]) -> Result<(), FlashError> {
        let damage = match self.cut {
            Some((cut, _)) if self.operations > cut => return Err(FlashError::Off),
            Some((cut, damage)) if self.operations == cut => damage,
            _ => Damage::All,
        };
        let cut = self.cut.is_some_and(|(cut, _)| self.operations == cut);
        self.operations += 1;
        if !self.worn.as_ref().is_some_and(|worn| worn.contains(&at)) {
            damage.apply(&mut self.bytes[at..at + to.len()], to);
            let words = &mut self.torn[at / WORD..(at + to.len()) / WORD];
            match damage {
                Damage::All => words.fill(false),
                Damage::SomeBits(_) => words.fill(WORD > 8),
                // Half a sector is of whole words, half a word is not.
                Damage::LowHalf | Damage::HighHalf if words.len() == 1 => words.fill(WORD > 8),
                Damage::LowHalf | Damage::HighHalf | Damage::Nothing => {}
            }
        }
        if cut { Err(FlashError::Off) } else { Ok(()) }
    }
}

impl<const WORD: usize> ErrorType for WordFlash<WORD> {
    type Error = FlashError;
}

impl<const WORD: usize> ReadNorFlash for WordFlash<WORD> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Refused)?;
        if self.is_off() {
            return Err(FlashError::Off);
        }
        let at = offset as usize;
        for (place, byte) in (at..).zip(bytes) {
            *byte = if self.torn[place / WORD] {
                0
            } else {
                self.bytes[place]
            };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WORD: usize> SettingsFlash for WordFlash<WORD> {
    fn outputs_are_off(&self) -> bool {
        !self.outputs_on
    }
}

impl<const WORD: usize> NorFlash for WordFlash<WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Refused)?;
        for start in (from as usize..to as usize).step_by(SECTOR) {
            self.operate(start, &[0xFF; SECTOR])?;
            self.programmed[start / WORD..(start + SECTOR) / WORD].fill(false);
            self.erasures[start / SECTOR] += 1;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Refused)?;
        for (index, word) in bytes.chunks_exact(WORD).enumerate() {
            let at = offset as usize + WORD * index;
            let refuses = |words: &std::ops::Range<usize>| words.contains(&at);
            if self.programmed[at / WORD] || self.refusing.as_ref().is_some_and(refuses) {
                return Err(FlashError::WrittenTwice);
            }
            // A cut before the operation leaves the word as it is.
            self.programmed[at / WORD] = self.cut != Some((self.operations, Damage::Nothing));
            // Writing can only clear bits.
            let old = &self.bytes[at..at + WORD];
            let to: Vec<u8> = old.iter().zip(word).map(|(old, new)| old & new).collect();
            self.operate(at, &to)?;
        }
        Ok(())
    }
}
