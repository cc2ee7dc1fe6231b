//! Axes that a host has built, for a board that holds no settings.

use serde::{Deserialize, Serialize};

use super::axis::{AxisName, AxisSet};
use super::machine::NumberType;
use super::observe::Words;
use crate::frame::CRC;

/// A part of a set: the machine first, then every axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LoadPart {
    /// Rules of operation, and bounds of the motions.
    Machine,
    /// Everything that the control tick of an axis reads.
    Axis(AxisName),
}

/// The head of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadHeader {
    /// The part.
    pub part: LoadPart,
    /// Layout of the words, as [`LoadStatus::fingerprint`] has it.
    pub fingerprint: u32,
    /// Number type that the axes are built for.
    pub number: NumberType,
    /// Control rate that they are built for, Hz.
    pub rate_hz: u32,
    /// Number of the set, the same for all of its parts. Parts of different sets do not go together.
    pub set: u32,
    /// Words of the part.
    pub words: u16,
    /// CRC-32 of the part: [`LoadHeader::checksum`].
    pub crc: u32,
}

impl LoadHeader {
    /// The CRC of the head but for the CRC itself: to be updated with the part's words, in order.
    ///
    /// It is that of the frames, of six words and then the part's, each little-endian: fingerprint, number type (0 `f32`, 1 fixed
    /// point, 2 `f64`), control rate, set, part (0 machine, 1 x, 2 y, 3 z), number of words.
    pub fn checksum(&self) -> Checksum {
        let number = match self.number {
            NumberType::F32 => 0,
            NumberType::Fixed => 1,
            NumberType::F64 => 2,
        };
        let part = match self.part {
            LoadPart::Machine => 0,
            LoadPart::Axis(AxisName::X) => 1,
            LoadPart::Axis(AxisName::Y) => 2,
            LoadPart::Axis(AxisName::Z) => 3,
        };
        let mut checksum = Checksum(CRC.digest());
        checksum.update([
            self.fingerprint,
            number,
            self.rate_hz,
            self.set,
            part,
            self.words.into(),
        ]);
        checksum
    }
}

/// A CRC-32 of words.
#[derive(Clone)]
pub struct Checksum(crc::Digest<'static, u32>);

impl Checksum {
    /// Takes more words.
    pub fn update(&mut self, words: impl IntoIterator<Item = u32>) {
        for word in words {
            self.0.update(&word.to_le_bytes());
        }
    }

    /// The CRC of all words.
    pub fn value(self) -> u32 {
        self.0.finalize()
    }
}

/// A request to load axes, or about what is loaded.
// Nothing here can be boxed: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LoadRequest {
    /// Asks what the board takes, and what is loaded.
    State,
    /// Begins a part; what was received of another is dropped. The machine begins a set: from then on the outputs stay off until
    /// all of it is there.
    Begin(LoadHeader),
    /// The next words of the part.
    Words {
        /// The place of the first of them, from zero. Words that the board has already are passed over, so that a request may be
        /// repeated; if any is missing, nothing is taken.
        offset: u16,
        /// The words, in order.
        words: Words,
    },
}

/// The layout and number type that a board takes, and the axes that are loaded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadStatus {
    /// Layout of the words: it differs between releases whose axes differ.
    pub fingerprint: u32,
    /// The number type of the control law.
    pub number: NumberType,
    /// Control rate, Hz.
    pub rate_hz: u32,
    /// The part under way, or the last one.
    pub part: Option<LoadPart>,
    /// Words of it that the board has.
    pub received: u16,
    /// The set that is loaded or under way.
    pub set: Option<u32>,
    /// Its axes that the control law has; with all of them the set is in force.
    pub axes: AxisSet,
}
