//! The settings of an absolute encoder with a serial interface.

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, EnumString, VariantNames};

use super::axis::AxisSettings;
use super::leaves::default;
use quadrant_law::encoder::Anchor;
use quadrant_law::rounding;
use quadrant_law::units::EncoderCount;

/// The protocol of a serial encoder.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, AsRefStr, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum SerialProtocol {
    /// BiSS-C, point to point.
    BissC,
    /// SSI.
    Ssi,
}

/// The bit behind the position in a word of SSI.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, AsRefStr, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum CheckBit {
    /// There is none.
    None,
    /// It makes the number of ones in position and itself even.
    EvenParity,
    /// It makes that number odd.
    OddParity,
    /// The encoder's error, active high.
    Error,
}

/// A serial encoder in the place of A, B and index.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct SerialSettings {
    /// Protocol.
    #[tree(with = miniconf::leaf)]
    pub protocol: SerialProtocol,
    /// Largest clock, Hz; the board takes the next below that it has.
    pub clock_hz: f64,
    /// True if the position of SSI comes in Gray code.
    pub gray: bool,
    /// Bit behind the position of SSI.
    #[tree(with = miniconf::leaf)]
    pub check_bit: CheckBit,
}

impl Default for SerialSettings {
    /// BiSS-C at 3 MHz.
    fn default() -> Self {
        Self {
            protocol: SerialProtocol::BissC,
            clock_hz: default!("encoder.serial.clock_hz"),
            gray: false,
            check_bit: CheckBit::None,
        }
    }
}

impl SerialSettings {
    /// Bytes that are clocked for a frame with a position of `counter_bits`. For BiSS-C eight, since encoder and cable decide where the
    /// position starts; for SSI those that hold the word and a bit on either side, since its clock is slow.
    pub const fn frame_bytes(&self, counter_bits: u8) -> usize {
        match self.protocol {
            SerialProtocol::BissC => 8,
            SerialProtocol::Ssi => (counter_bits as usize + 3).div_ceil(8),
        }
    }
}

impl AxisSettings {
    /// The middle of the travel, mm; zero without one. From it, positions of an absolute encoder are half of its range away at most.
    fn middle_mm(&self) -> f64 {
        let travel = self.limits.travel_mm;
        travel.map_or(0.0, |travel| 0.5 * (travel.negative + travel.positive))
    }

    /// The place that makes the encoder an absolute one, if its offset is known.
    pub(super) fn build_anchor(&self) -> Option<Anchor> {
        let encoder = &self.encoder;
        let offset_mm = encoder.offset_mm?;
        let counts = |value_mm: f64| rounding::round(value_mm / encoder.resolution_mm) as i64;
        let middle = counts(self.middle_mm());
        let raw = middle + counts(offset_mm);
        Some(Anchor {
            // Wraps as the encoder's count does.
            raw: (if encoder.reversed { -raw } else { raw }) as u32,
            position: EncoderCount(middle).position(),
        })
    }
}
