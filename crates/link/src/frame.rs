//! Frames: COBS(payload, CRC-32) and a zero byte; the payload is the protocol's version and a postcard message.
//!
//! Zero ends a frame and occurs nowhere within one, so a receiver that has lost its place finds it again at the next zero.

use core::fmt;

use cobs::{DecodeResult, DecoderState};
use crc::{CRC_32_ISO_HDLC, Crc, Digest};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::PROTOCOL_VERSION;

/// Largest frame, the zero at its end included.
pub const FRAME_BYTES: usize = 512;

/// Largest payload: a frame without the CRC, the most that COBS adds, and the zero.
pub const PAYLOAD_BYTES: usize = 504;

/// The byte that ends a frame. A sender that opens a connection sends one first, so that noise on the line before it
/// does not cost its first frame.
pub const DELIMITER: u8 = 0;

const CRC_BYTES: usize = 4;

const BODY_BYTES: usize = PAYLOAD_BYTES + CRC_BYTES;

const _: () = assert!(cobs::max_encoding_length(BODY_BYTES) < FRAME_BYTES);

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The CRC of any body followed by its own CRC.
const RESIDUE: u32 = CRC_32_ISO_HDLC.residue ^ CRC_32_ISO_HDLC.xorout;

/// The buffer is too small for the frame, or the message larger than any frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodeError {
    /// Size of the buffer, bytes.
    pub room: usize,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "frame: the message does not fit {} bytes; no frame is larger than {FRAME_BYTES}",
            self.room
        )
    }
}

impl core::error::Error for EncodeError {}

/// Writes a message's frame to the start of `out`, for which [`FRAME_BYTES`] always suffice, and returns it. Takes 508
/// bytes of stack: one after the other, postcard, CRC and COBS take 2.7 KB less flash than all three in one pass.
pub fn encode<'a, T: Serialize>(message: &T, out: &'a mut [u8]) -> Result<&'a [u8], EncodeError> {
    let room = out.len().min(FRAME_BYTES);
    let error = EncodeError { room };
    let mut body = [0; BODY_BYTES];
    let (payload, _) = body.split_at_mut(PAYLOAD_BYTES);
    let payload = postcard::to_slice(&(PROTOCOL_VERSION, message), payload).map_err(|_| error)?;
    let crc = CRC.checksum(payload).to_le_bytes();
    let length = payload.len();
    body[length..length + CRC_BYTES].copy_from_slice(&crc);
    let encoded = cobs::try_encode(&body[..length + CRC_BYTES], &mut out[..room]);
    let end = encoded.map_err(|_| error)?;
    *out[..room].get_mut(end).ok_or(error)? = DELIMITER;
    Ok(&out[..=end])
}

/// A payload that is no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// It has another version of the protocol: this one.
    Version(u8),
    /// It is malformed.
    Malformed,
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version(theirs) => write!(
                f,
                "protocol: the other side speaks version {theirs}, this side version {PROTOCOL_VERSION}; use host tools \
                 and firmware of one release"
            ),
            Self::Malformed => f.write_str("protocol: the message is not one of this version"),
        }
    }
}

impl core::error::Error for DecodeError {}

/// Decodes the message in a payload.
pub fn decode<T: DeserializeOwned>(payload: &[u8]) -> Result<T, DecodeError> {
    match payload.split_first() {
        Some((&PROTOCOL_VERSION, message)) => decode_whole(message).ok_or(DecodeError::Malformed),
        Some((&version, _)) => Err(DecodeError::Version(version)),
        None => Err(DecodeError::Malformed),
    }
}

/// Decodes a value from bytes that hold nothing else.
pub(crate) fn decode_whole<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Some(value),
        _ => None,
    }
}

/// Counts of the frames received; each wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameCounters {
    /// Frames whose CRC was right.
    pub good: u32,
    /// Frames cut short, or with a wrong CRC.
    pub damaged: u32,
    /// Frames longer than any message.
    pub overlong: u32,
    /// Good frames that held no message of this protocol version.
    pub undecodable: u32,
}

/// Finds the frames in a stream of bytes. Every byte costs the same: COBS and CRC are worked out as
/// the bytes come.
pub struct Receiver {
    body: [u8; BODY_BYTES],
    length: usize,
    cobs: DecoderState,
    crc: Digest<'static, u32>,
    overlong: bool,
    pub(crate) counters: FrameCounters,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// Returns a receiver before the first byte.
    pub const fn new() -> Self {
        Self {
            body: [0; BODY_BYTES],
            length: 0,
            cobs: DecoderState::Idle,
            crc: CRC.digest(),
            overlong: false,
            counters: FrameCounters {
                good: 0,
                damaged: 0,
                overlong: 0,
                undecodable: 0,
            },
        }
    }

    /// Takes a byte; returns the payload of the frame that it ends.
    pub fn push(&mut self, byte: u8) -> Option<&[u8]> {
        match self.cobs.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataContinue(decoded)) => {
                match self.body.get_mut(self.length) {
                    Some(place) => {
                        *place = decoded;
                        self.length += 1;
                        self.crc.update(&[decoded]);
                    }
                    None => self.overlong = true,
                }
                None
            }
            Ok(DecodeResult::DataComplete) => self.finish(true),
            Err(_) => self.finish(false),
        }
    }

    /// Counts of the frames received so far.
    pub const fn counters(&self) -> FrameCounters {
        self.counters
    }

    /// At the zero that ends a frame.
    fn finish(&mut self, whole: bool) -> Option<&[u8]> {
        let length = core::mem::take(&mut self.length);
        let crc = core::mem::replace(&mut self.crc, CRC.digest()).finalize();
        let overlong = core::mem::take(&mut self.overlong);
        let counters = &mut self.counters;
        let (counter, good) = match (overlong, whole && crc == RESIDUE) {
            (true, _) => (&mut counters.overlong, false),
            (false, false) => (&mut counters.damaged, false),
            (false, true) => (&mut counters.good, true),
        };
        *counter = counter.wrapping_add(1);
        let payload = self.body.get(..length.checked_sub(CRC_BYTES)?)?;
        good.then_some(payload)
    }
}
