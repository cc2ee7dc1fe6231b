//! Samples: telemetry while they are taken, and captures around a trigger.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::capture::{CapturePhase, CaptureRecord, Trigger};
use super::channel::Channel;

/// Channels that a selection holds at most, which bounds the reads of a tick.
pub const MAX_CHANNELS: usize = 8;

/// Capacity of a block in words: 14 samples of 8 channels, 112 of one.
pub const BLOCK_WORDS: usize = 112;

/// Capacity of a block in bytes.
pub const BLOCK_BYTES: usize = 4 * BLOCK_WORDS;

/// Values a second that a serial port carries in blocks: `docs/link.md`, Telemetry.
pub const SERIAL_VALUES_PER_S: f64 = 21_500.0;

/// Bytes of the log in a page at most.
pub const LOG_PAGE_BYTES: usize = 256;

/// Bytes of the log, as defmt encodes it: the firmware's image has its strings.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogPage {
    /// Number of the first byte since the start, wrapping: later than was asked for by what is lost.
    pub from: u32,
    /// The bytes; none if there are no newer ones.
    pub bytes: Vec<u8, LOG_PAGE_BYTES>,
}

/// Words of samples, little-endian, four bytes each.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleWords(Vec<u8, BLOCK_BYTES>);

impl SampleWords {
    /// Returns an empty list.
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// Appends words. Returns false, and appends nothing, if there is no room for all of them.
    #[must_use]
    pub fn extend(&mut self, words: impl ExactSizeIterator<Item = u32>) -> bool {
        let fits = words.len() <= BLOCK_WORDS - self.len();
        if fits {
            for word in words {
                // Cannot fail: the room was looked at before.
                let _ = self.0.extend_from_slice(&word.to_le_bytes());
            }
        }
        fits
    }

    /// Number of words.
    pub fn len(&self) -> usize {
        self.0.len() / 4
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The words, in order; bytes beyond the last whole word, which only a wrong sender makes, are left out.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        let (words, _) = self.0.as_chunks();
        words.iter().map(|&bytes| u32::from_le_bytes(bytes))
    }
}

/// Consecutive samples of one selection. Sample `k` has the number `sequence + k`, and its tick is
/// `tick + k * decimation`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TelemetryBlock {
    /// The selection's generation, as in the acknowledgement of its request.
    pub generation: u8,
    /// Number of the first sample since the selection was made.
    pub sequence: u32,
    /// The control tick of the first sample.
    pub tick: u32,
    /// Samples of this selection that were dropped so far; wraps.
    pub dropped: u32,
    /// Words of a sample.
    pub channels: u8,
    /// The samples, one after the other.
    pub words: SampleWords,
}

impl TelemetryBlock {
    /// Its samples in order: the number of each since the selection was made, and its words, a channel each.
    pub fn samples(&self) -> impl Iterator<Item = (u32, impl Iterator<Item = u32> + '_)> + '_ {
        let channels = usize::from(self.channels).max(1);
        (0..self.words.len() / channels).map(move |index| {
            let words = self.words.iter().skip(index * channels).take(channels);
            (self.sequence.wrapping_add(index as u32), words)
        })
    }
}

/// A request about the telemetry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TelemetryRequest {
    /// Sends samples; another selection ends.
    Select {
        /// The channels, in the order of a sample's words.
        channels: Vec<Channel, MAX_CHANNELS>,
        /// Control ticks from one sample to the next; at least 1.
        decimation: u16,
    },
    /// Ends the selection.
    Stop,
}

/// A request about the capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum CaptureRequest {
    /// Discards the last record and waits for a trigger.
    Arm {
        /// The channels, in the order of a sample's words.
        channels: Vec<Channel, MAX_CHANNELS>,
        /// Control ticks from one sample to the next; at least 1.
        decimation: u16,
        /// Share of the ring for what comes before the trigger, percent; 0 to 100.
        pre_trigger_percent: u8,
        /// The event that freezes the ring.
        trigger: Trigger,
    },
    /// Freezes the samples taken so far.
    Disarm,
    /// Asks for its progress.
    State,
    /// Asks for the words from an offset on.
    Read {
        /// Words before the first one asked for.
        offset: u16,
    },
}

/// The status of the capture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureStatus {
    /// Its progress.
    pub phase: CapturePhase,
    /// Count of its records since the start; wraps. Pages of one capture are read under one number.
    pub number: u16,
    /// The recorded channels.
    pub channels: Vec<Channel, MAX_CHANNELS>,
    /// Control ticks from one sample to the next; 1 before it was first armed.
    pub decimation: u16,
    /// The record, if it is frozen.
    pub record: Option<CaptureRecord>,
}

/// Some of the capture's words: sample after sample, the oldest first. None at or behind the end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WordPage {
    /// The capture's number, as in [`CaptureStatus::number`].
    pub number: u16,
    /// Words before the first of these.
    pub offset: u16,
    /// The words, little-endian.
    pub words: SampleWords,
}
