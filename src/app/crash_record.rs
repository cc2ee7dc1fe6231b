//! The crash record: the cause and text of a failure, in memory that the start-up code does not clear.
//!
//! After power-up that memory holds noise, after a reset what was there before: a magic word and a CRC-32 distinguish the
//! two. The board places the record; this module encodes it.

use core::fmt::{self, Write};

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// "QLW1": the record's layout, too.
const MAGIC: [u8; 4] = *b"QLW1";
/// CRC-32 as Ethernet and zlib have it, without a table: it runs once in a life.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Capacity of the text, bytes.
pub const TEXT_BYTES: usize = 236;

/// The cause of a crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashCause {
    /// A panic.
    Panic,
    /// A hard fault: a bus error, an undefined instruction, the end of the stack.
    HardFault,
    /// An interrupt that has no handler.
    StrayInterrupt,
    /// The board's clock has failed.
    ClockFailed,
}

impl CrashCause {
    /// The cause in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::HardFault => "hard fault",
            Self::StrayInterrupt => "interrupt without a handler",
            Self::ClockFailed => "failure of the clock",
        }
    }

    const fn number(self) -> u8 {
        match self {
            Self::Panic => 1,
            Self::HardFault => 2,
            Self::StrayInterrupt => 3,
            Self::ClockFailed => 4,
        }
    }

    const fn from_number(number: u8) -> Option<Self> {
        match number {
            1 => Some(Self::Panic),
            2 => Some(Self::HardFault),
            3 => Some(Self::StrayInterrupt),
            4 => Some(Self::ClockFailed),
            _ => None,
        }
    }
}

/// A crash record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// The cause of the crash.
    pub cause: CrashCause,
    /// The control tick of the crash.
    pub tick: u32,
    length: u8,
    text: [u8; TEXT_BYTES],
}

impl CrashRecord {
    /// Bytes of the record: magic, tick, kind, length of the text, two of padding, text, CRC-32; words are
    /// little-endian.
    pub const BYTES: usize = 12 + TEXT_BYTES + 4;

    /// Makes a record; a text longer than [`TEXT_BYTES`] loses its end.
    pub fn new(cause: CrashCause, tick: u32, text: impl fmt::Display) -> Self {
        let mut record = Self {
            cause,
            tick,
            length: 0,
            text: [0; TEXT_BYTES],
        };
        // It fails when the text is full: what fits is kept.
        let _ = write!(record, "{text}");
        record
    }

    /// The text, without a last character that was cut.
    pub fn text(&self) -> &str {
        let written = self.text.get(..usize::from(self.length)).unwrap_or(&[]);
        match core::str::from_utf8(written) {
            Ok(text) => text,
            // Never more than what precedes the character that is broken.
            Err(error) => written
                .get(..error.valid_up_to())
                .and_then(|sound| core::str::from_utf8(sound).ok())
                .unwrap_or(""),
        }
    }

    /// Encodes the record.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let body = [
            MAGIC.as_slice(),
            &self.tick.to_le_bytes(),
            &[self.cause.number(), self.length, 0, 0],
            &self.text,
        ];
        let (record, checksum) = bytes.split_at_mut(Self::BYTES - 4);
        for (slot, byte) in record.iter_mut().zip(body.into_iter().flatten()) {
            *slot = *byte;
        }
        checksum.copy_from_slice(&CRC.checksum(record).to_le_bytes());
        bytes
    }

    /// Decodes a record; `None` for noise.
    pub fn decode(bytes: &[u8; Self::BYTES]) -> Option<Self> {
        let (record, checksum) = bytes.split_last_chunk::<4>()?;
        if CRC.checksum(record) != u32::from_le_bytes(*checksum) {
            return None;
        }
        let (magic, rest) = record.split_first_chunk::<4>()?;
        let (tick, rest) = rest.split_first_chunk::<4>()?;
        let ([cause, length, _, _], text) = rest.split_first_chunk::<4>()?;
        let words = Self {
            cause: CrashCause::from_number(*cause)?,
            tick: u32::from_le_bytes(*tick),
            length: *length,
            text: text.try_into().ok()?,
        };
        (*magic == MAGIC && usize::from(words.length) <= TEXT_BYTES).then_some(words)
    }
}

impl fmt::Write for CrashRecord {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = self
            .text
            .get_mut(usize::from(self.length)..)
            .unwrap_or(&mut []);
        // Whole characters only.
        let mut fitting = text.len().min(room.len());
        while !text.is_char_boundary(fitting) {
            fitting -= 1;
        }
        let (kept, _) = text.as_bytes().split_at(fitting);
        for (slot, byte) in room.iter_mut().zip(kept) {
            *slot = *byte;
        }
        self.length += fitting as u8;
        if fitting == text.len() {
            Ok(())
        } else {
            Err(fmt::Error)
        }
    }
}
