//! Items in two sectors, the newest of which survives whatever happens while another is written.
//!
//! sequential-storage lays the items out in each sector, as a queue of one page, with their checksums; every item starts
//! with a sequence number, and the one with the highest is the newest. The rule that keeps it: words are written only
//! where the sector is blank, and only the sector that does not hold the newest item is erased, just before it is used.
//! So no operation, wherever it is cut, touches the newest item; and cells that a cut erasure left in doubt are erased
//! again before they are trusted. A new item counts only once it has been read back.

use core::fmt;
use core::ops::Range;

use embassy_futures::block_on;
use embedded_storage::nor_flash::NorFlash;
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::queue::{QueueConfig, QueueStorage};

use super::sector::{Access, Sector, SectorError};

/// Bytes of the sequence number at the start of an item.
pub(super) const SEQUENCE_BYTES: usize = 4;

/// Reason why nothing was stored, or read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LogError<E> {
    /// The flash failed; what was stored last is still there.
    Flash(E),
    /// The bytes just written, or read, cannot be read back: the flash is worn out or broken.
    NotKept,
}

impl<E: fmt::Debug> fmt::Display for LogError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flash(error) => write!(f, "the flash failed: {error:?}"),
            Self::NotKept => f.write_str(
                "the flash does not keep what is written: it is worn out or broken, replace the board",
            ),
        }
    }
}

/// Place of the newest item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    sector: u32,
    pub(super) sequence: u32,
    pub(super) length: usize,
}

type Queue<'f, F> = QueueStorage<Sector<'f, F>, Cache<Uncached, Uncached, Uncached>>;

/// The two sectors from `start` on of a flash.
#[derive(Clone, Debug)]
pub(super) struct Log<F> {
    pub(super) flash: F,
    start: u32,
}

impl<F: NorFlash> Log<F> {
    const SECTOR: Range<u32> = 0..F::ERASE_SIZE as u32;

    pub(super) fn new(flash: F, start: u32) -> Self {
        Self { flash, start }
    }

    fn sector(&mut self, sector: u32, access: Access) -> Queue<'_, F> {
        let start = self.start + sector * Self::SECTOR.end;
        let flash = &mut self.flash;
        let sector = Sector {
            flash,
            start,
            access,
        };
        QueueStorage::new(
            sector,
            const { QueueConfig::new(Self::SECTOR) },
            Cache::new_uncached(),
        )
    }

    /// Reads items of a sector until `stop`, or all; returns the one with the highest sequence number. `buffer` holds the
    /// last that was read.
    fn scan(
        &mut self,
        sector: u32,
        buffer: &mut [u8],
        stop: Option<u32>,
    ) -> Result<Option<Place>, LogError<F::Error>> {
        let mut newest: Option<Place> = None;
        let mut queue = self.sector(sector, Access::Read);
        let scanned = block_on(async {
            let mut items = queue.iter().await?;
            while let Some(item) = items.next(buffer).await? {
                let Some(sequence) = item.first_chunk().copied().map(u32::from_le_bytes) else {
                    continue;
                };
                if newest.is_none_or(|newest| newest.sequence < sequence) {
                    newest = Some(Place {
                        sector,
                        sequence,
                        length: item.len(),
                    });
                }
                if stop == Some(sequence) {
                    break;
                }
            }
            Ok(())
        });
        match scanned {
            Err(Error::Storage {
                value: SectorError::Flash(error),
                ..
            }) => Err(LogError::Flash(error)),
            // What follows is no item of ours; an item that was stored has been read back from before it.
            Err(_) | Ok(()) => Ok(newest),
        }
    }

    /// The newest item's place.
    fn newest(&mut self, buffer: &mut [u8]) -> Result<Option<Place>, LogError<F::Error>> {
        let first = self.scan(0, buffer, None)?;
        let second = self.scan(1, buffer, None)?;
        Ok(match (first, second) {
            (Some(first), Some(second)) if second.sequence > first.sequence => Some(second),
            (None, second) => second,
            (first, _) => first,
        })
    }

    /// Reads the newest item into the buffer, its sequence number first.
    pub(super) fn read(&mut self, buffer: &mut [u8]) -> Result<Option<Place>, LogError<F::Error>> {
        let Some(place) = self.newest(buffer)? else {
            return Ok(None);
        };
        let again = self.scan(place.sector, buffer, Some(place.sequence))?;
        if again == Some(place) {
            Ok(again)
        } else {
            Err(LogError::NotKept)
        }
    }

    /// Writes an item, which `fill` puts into the buffer behind the sequence number given, returning its length with that.
    /// `fill` is called again when the sector is full, for the buffer is read into meanwhile.
    pub(super) fn write<X>(
        &mut self,
        buffer: &mut [u8],
        mut fill: impl FnMut(&mut [u8], u32) -> Result<usize, X>,
    ) -> Result<Result<Stored, LogError<F::Error>>, X> {
        let newest = match self.newest(buffer) {
            Ok(newest) => newest,
            Err(error) => return Ok(Err(error)),
        };
        let sequence = newest.map_or(1, |newest| newest.sequence.wrapping_add(1));
        let appended = newest.map(|newest| (newest.sector, false));
        let other = newest.map_or(0, |newest| 1 - newest.sector);
        // Without an item there is none to spare, and either sector may be erased.
        let last = newest.is_none().then_some((1, true));
        for (sector, erase) in [appended, Some((other, true)), last].into_iter().flatten() {
            let length = fill(buffer, sequence)?;
            let written = self.write_to(sector, erase, buffer, length, sequence);
            match written {
                Ok(true) => {
                    return Ok(Ok(Stored {
                        sequence,
                        erased: erase,
                    }));
                }
                Err(error) if erase => return Ok(Err(error)),
                // What a cut left in the sector may not take a word; the other sector is to be had.
                Ok(false) | Err(_) => {}
            }
        }
        Ok(Err(LogError::NotKept))
    }

    /// Writes an item to one sector; false if it is not there afterwards.
    fn write_to(
        &mut self,
        sector: u32,
        erase: bool,
        buffer: &mut [u8],
        length: usize,
        sequence: u32,
    ) -> Result<bool, LogError<F::Error>> {
        if erase {
            let start = self.start + sector * Self::SECTOR.end;
            self.flash
                .erase(start, start + Self::SECTOR.end)
                .map_err(LogError::Flash)?;
        }
        let item = buffer.get(..length).unwrap_or_default();
        let mut queue = self.sector(sector, Access::Append);
        match block_on(queue.push(item, false)) {
            Ok(()) => {}
            Err(Error::Storage {
                value: SectorError::Flash(error),
                ..
            }) => return Err(LogError::Flash(error)),
            Err(_) => return Ok(false),
        }
        let read_back = self.scan(sector, buffer, Some(sequence))?;
        Ok(read_back.is_some_and(|place| place.sequence == sequence && place.length == length))
    }
}

/// Effort of storing an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Its sequence number: how many sets have been stored, this one included.
    pub sequence: u32,
    /// True if a sector was erased for it, which takes the flash a quarter to half a second.
    pub erased: bool,
}
