//! Items in two sectors, the newest of which survives every interruption while another is written.
//!
//! sequential-storage lays the items out in each sector, as a queue of one page, with their checksums; every item starts
//! with a sequence number, and the one with the highest is the newest. The rule that keeps it: words are written only
//! where the sector is blank, and only the sector that does not hold the newest item is erased, just before it is used.
//! So no operation, wherever it is cut, touches the newest item; and cells that a cut erasure left in doubt are erased
//! again before they are trusted. A new item counts only once it has been read back.

use core::cell::Cell;
use core::fmt;
use core::ops::Range;

use embassy_futures::block_on;
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::queue::{QueueConfig, QueueStorage};

use super::sector::{Access, Sector, SectorError};
use crate::hal::SettingsFlash;

/// Bytes of the sequence number at the start of an item.
pub(super) const SEQUENCE_BYTES: usize = 4;

/// Reason why nothing was stored, or read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LogError<E> {
    /// The flash failed; what was stored last is still there.
    Flash(E),
    /// The bytes just written, or read, cannot be read back: the flash is worn out or broken.
    NotKept,
    /// The amplifiers' enable line is high.
    OutputsOn,
    /// Neither sector holds a set that can be read, and they are not blank.
    Damaged,
}

impl<E: fmt::Debug> fmt::Display for LogError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flash(error) => write!(f, "the flash failed: {error:?}"),
            Self::NotKept => f.write_str(
                "the flash does not keep what is written: it is worn out or broken, replace the board",
            ),
            Self::OutputsOn => f.write_str("the outputs are on; disable them before flash is written"),
            Self::Damaged => f.write_str("what is stored is damaged: nothing of it can be read"),
        }
    }
}

/// Place of the newest item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    sector: u32,
    pub(super) sequence: u32,
    pub(super) length: usize,
    /// The end of the item, in its sector.
    end: u32,
}

/// The newest item that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Newest {
    pub(super) place: Place,
    /// Nothing is stored that could be the remains of a newer one.
    pub(super) is_certain: bool,
}

type Queue<'f, F> = QueueStorage<Sector<'f, F>, Cache<Uncached, Uncached, Uncached>>;

/// The two sectors from `start` on of a flash.
#[derive(Clone, Debug)]
pub(super) struct Log<F> {
    pub(super) flash: F,
    start: u32,
}

impl<F: SettingsFlash> Log<F> {
    const SECTOR: Range<u32> = 0..F::ERASE_SIZE as u32;

    pub(super) fn new(flash: F, start: u32) -> Self {
        Self { flash, start }
    }

    fn sector<'f>(
        &'f mut self,
        sector: u32,
        access: Access,
        read_to: &'f Cell<u32>,
    ) -> Sector<'f, F> {
        let start = self.start + sector * Self::SECTOR.end;
        Sector {
            flash: &mut self.flash,
            start,
            access,
            read_to,
        }
    }

    fn queue<'f>(
        &'f mut self,
        sector: u32,
        access: Access,
        read_to: &'f Cell<u32>,
    ) -> Queue<'f, F> {
        QueueStorage::new(
            self.sector(sector, access, read_to),
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
        let read_to = Cell::new(0);
        let mut queue = self.queue(sector, Access::Read, &read_to);
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
                        end: read_to.get(),
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

    /// The newest item's place; of the other sector, true if an item can be read there.
    fn newest(&mut self, buffer: &mut [u8]) -> Result<Option<(Place, bool)>, LogError<F::Error>> {
        let first = self.scan(0, buffer, None)?;
        let second = self.scan(1, buffer, None)?;
        Ok(match (first, second) {
            (Some(first), Some(second)) if second.sequence > first.sequence => Some((second, true)),
            (Some(first), second) => Some((first, second.is_some())),
            (None, second) => second.map(|second| (second, false)),
        })
    }

    /// True if a sector reads as erased from an offset on, but for the library's mark that it is full.
    fn is_blank_from(&mut self, sector: u32, from: u32) -> Result<bool, LogError<F::Error>> {
        let from = from.next_multiple_of(F::WRITE_SIZE as u32);
        let end = Self::SECTOR.end - F::WRITE_SIZE as u32;
        let read_to = Cell::new(0);
        let blank = self
            .sector(sector, Access::Read, &read_to)
            .is_blank(from, end.saturating_sub(from) as usize);
        match blank {
            Err(SectorError::Flash(error)) => Err(LogError::Flash(error)),
            Err(SectorError::Forbidden) => Ok(false),
            Ok(blank) => Ok(blank),
        }
    }

    /// Reads the newest item into the buffer, its sequence number first; nothing, if the flash is blank.
    ///
    /// Items are written one behind the other, and a sector is erased only when the other one is full. So the bytes
    /// behind the newest item, or in the other sector where no item can be read, may be the remains of a newer one.
    pub(super) fn read(&mut self, buffer: &mut [u8]) -> Result<Option<Newest>, LogError<F::Error>> {
        let Some((place, other_is_read)) = self.newest(buffer)? else {
            return if self.is_blank_from(0, 0)? && self.is_blank_from(1, 0)? {
                Ok(None)
            } else {
                Err(LogError::Damaged)
            };
        };
        let is_certain = self.is_blank_from(place.sector, place.end)?
            && (other_is_read || self.is_blank_from(1 - place.sector, 0)?);
        let again = self.scan(place.sector, buffer, Some(place.sequence))?;
        if again == Some(place) {
            Ok(Some(Newest { place, is_certain }))
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
        if !self.flash.outputs_are_off() {
            return Ok(Err(LogError::OutputsOn));
        }
        let newest = match self.newest(buffer) {
            Ok(newest) => newest.map(|(place, _)| place),
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
                    if let Err(error) = self.clear_remains(1 - sector, buffer) {
                        return Ok(Err(error));
                    }
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

    /// Erases a sector that holds no item that can be read, unless it is blank: its content could be taken for the remains
    /// of a newer one.
    fn clear_remains(&mut self, sector: u32, buffer: &mut [u8]) -> Result<(), LogError<F::Error>> {
        if self.scan(sector, buffer, None)?.is_some() || self.is_blank_from(sector, 0)? {
            return Ok(());
        }
        self.erase(sector)
    }

    fn erase(&mut self, sector: u32) -> Result<(), LogError<F::Error>> {
        if !self.flash.outputs_are_off() {
            return Err(LogError::OutputsOn);
        }
        let start = self.start + sector * Self::SECTOR.end;
        self.flash
            .erase(start, start + Self::SECTOR.end)
            .map_err(LogError::Flash)
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
            self.erase(sector)?;
        }
        let item = buffer.get(..length).unwrap_or_default();
        let read_to = Cell::new(0);
        let mut queue = self.queue(sector, Access::Append, &read_to);
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
