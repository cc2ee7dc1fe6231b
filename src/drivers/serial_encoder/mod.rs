//! Absolute encoders with a serial interface, BiSS-C and SSI: from the bits that an SPI master shifted in to a reading.
//!
//! The master clocks some bytes a tick ([`SerialSettings::frame_bytes`]), just before it ([`times`]), and rests until the next one.
//! [`SerialEncoder::take`] decodes them ([`biss`], [`ssi`]) and judges the frame:
//!
//! | frame | reading |
//! |---|---|
//! | whole | its count |
//! | not received in time | not fresh |
//! | with the encoder's error bit | not valid |
//! | damaged, the first after [`BRIDGE_AFTER`] whole ones | the last count and the last step: bridged |
//! | damaged otherwise | not valid |
//!
//! # One frame is bridged
//! The law switches off in the tick of a reading that is not fresh or not valid. A cable beside motor cables loses a frame now and
//! then, and one lost frame is no danger: the step of an axis changes in a tick by its acceleration times the period squared, 0.3 um
//! at 30 m/s² and 10 kHz, so that the bridged count is right within a count or a few. The next frame, one tick later, decides on what
//! it shows itself. A second damaged frame within [`BRIDGE_AFTER`] is a fault: each that comes has a chance of 1/64 to pass the check
//! sum of BiSS-C with many bits wrong. What the encoder reports itself is never bridged.

pub mod biss;
pub mod ssi;
pub mod times;

use quadrant_law::encoder::EncoderReading;
use quadrant_settings::{CheckBit, SerialProtocol, SerialSettings};

/// Whole frames that must come before a damaged one is bridged: 0.1 s at 10 kHz.
pub const BRIDGE_AFTER: u32 = 1000;

/// The most bytes of a frame: [`SerialSettings::frame_bytes`].
pub const MAX_FRAME_BYTES: usize = 8;

/// Content of a whole frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content {
    /// The position, in the low bits.
    pub count: u32,
    /// The encoder warns: it should be looked after, and its position is right.
    pub warning: bool,
    /// Bits before the first of the frame's own: rest, acknowledge. The same in every frame of an encoder.
    pub start: u32,
}

/// Reason why a frame is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// The line is not high before the frame or not low behind it, or the encoder does not acknowledge: a broken wire.
    Line,
    /// The check sum or the parity is wrong.
    CheckSum,
    /// The frame starts at another bit than those before.
    Moved,
    /// The encoder reports an error: its position is not to be trusted.
    Error,
}

/// Numbers of frames since the start; each stays at its largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Frames with [`Flaw::Line`].
    pub line: u32,
    /// Frames with [`Flaw::CheckSum`].
    pub check_sum: u32,
    /// Frames with [`Flaw::Moved`], from the first whole one on.
    pub moved: u32,
    /// Frames with the encoder's error bit.
    pub errors: u32,
    /// Frames with the encoder's warning bit.
    pub warnings: u32,
    /// Frames that were not received in time.
    pub late: u32,
    /// Frames that were bridged; they count above, too.
    pub bridged: u32,
}

/// Start bits of the last frames: an encoder acknowledges for the same number of bits each time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Start {
    known: Option<u32>,
    /// The other start of the last frame that moved.
    other: Option<u32>,
}

impl Start {
    /// True if a frame starts where the last ones did. Two frames in a row at another place make it the known one.
    fn is_kept(&mut self, start: u32) -> bool {
        let kept = self.known == Some(start);
        let repeated = self.other.take() == Some(start);
        if repeated {
            self.known = Some(start);
        } else if !kept {
            self.other = Some(start);
        }
        kept | repeated
    }
}

/// An encoder behind an SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialEncoder {
    protocol: SerialProtocol,
    gray: bool,
    check_bit: CheckBit,
    bits: u32,
    start: Start,
    count: u32,
    /// The last count less the one before, wrapping.
    step: u32,
    /// Whole frames since the last other one.
    whole: u32,
    /// Ticks since the last whole frame.
    age: u32,
    counts: FrameCounts,
}

impl SerialEncoder {
    /// An encoder with a position of `bits` (1 to 32), of which nothing was received.
    pub const fn new(settings: &SerialSettings, bits: u32) -> Self {
        Self {
            protocol: settings.protocol,
            gray: settings.gray,
            check_bit: settings.check_bit,
            bits,
            start: Start {
                known: None,
                other: None,
            },
            count: 0,
            step: 0,
            whole: 0,
            age: u32::MAX,
            counts: FrameCounts {
                line: 0,
                check_sum: 0,
                moved: 0,
                errors: 0,
                warnings: 0,
                late: 0,
                bridged: 0,
            },
        }
    }

    /// Takes the bits of this tick, the first in the highest, with zeros behind them; `None` if they did not all come. Once a tick.
    ///
    /// The first frame of BiSS-C is not valid: two must start at the same bit.
    pub fn take(&mut self, received: Option<u64>) -> EncoderReading {
        self.age = self.age.saturating_add(1);
        let Some(received) = received else {
            count(&mut self.counts.late);
            self.whole = 0;
            return self.reading(false, true);
        };
        match self.decode(received) {
            Ok(content) => {
                if content.warning {
                    count(&mut self.counts.warnings);
                }
                self.step = content.count.wrapping_sub(self.count);
                self.count = content.count;
                self.age = 0;
                count(&mut self.whole);
                self.reading(true, true)
            }
            Err(flaw) => {
                match flaw {
                    Flaw::Line => count(&mut self.counts.line),
                    Flaw::CheckSum => count(&mut self.counts.check_sum),
                    // Before the first whole frame, the start is being learnt.
                    Flaw::Moved if self.age == u32::MAX => {}
                    Flaw::Moved => count(&mut self.counts.moved),
                    Flaw::Error => count(&mut self.counts.errors),
                }
                let bridged = self.whole >= BRIDGE_AFTER && flaw != Flaw::Error;
                self.whole = 0;
                if bridged {
                    count(&mut self.counts.bridged);
                    let mask = u32::MAX >> (32 - self.bits.clamp(1, 32));
                    self.count = self.count.wrapping_add(self.step) & mask;
                }
                self.reading(true, bridged)
            }
        }
    }

    /// Numbers of frames since the start.
    pub const fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// Ticks since the last whole frame; 0 if that of this tick was whole.
    pub const fn age(&self) -> u32 {
        self.age
    }

    fn decode(&mut self, received: u64) -> Result<Content, Flaw> {
        let content = match self.protocol {
            SerialProtocol::BissC => biss::decode(received, self.bits),
            SerialProtocol::Ssi => {
                return ssi::decode(received, self.bits, self.gray, self.check_bit);
            }
        }?;
        if self.start.is_kept(content.start) {
            Ok(content)
        } else {
            Err(Flaw::Moved)
        }
    }

    const fn reading(&self, fresh: bool, valid: bool) -> EncoderReading {
        EncoderReading {
            count: self.count,
            index: None,
            fresh,
            valid,
        }
    }
}

const fn count(number: &mut u32) {
    *number = number.saturating_add(1);
}
