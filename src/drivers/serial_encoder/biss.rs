//! A frame of BiSS-C, point to point, without register access.
//!
//! ```text
//! MA  ‾‾|_|‾|_|‾|_|‾ ...                                              ‾‾‾‾‾‾‾‾
//! SLO ‾‾‾‾‾‾|_____________|‾‾‾‾‾‾‾|     |                |       |     |_______|‾‾
//!       rest  acknowledge   start   CDS   position, MSB..  nE, nW   CRC  time-out
//! ```
//!
//! Both lines rest high. The master samples SLO at rising edges of MA, before it changes. The encoder answers the second rising edge of MA with low, until its position is ready; cable and driver add
//! their delay. So the start bit is searched: the first high after the first low. CDS belongs to register access and says nothing
//! here. Error and warning are active low. The CRC is that of x⁶ + x + 1 over position, error and warning, transmitted inverted. The
//! line is low behind it until the encoder's time-out, which begins when MA rests.
//!
//! Sources: BiSS interface, protocol description C-mode; iC-Haus, data sheet iC-MU, "BiSS C interface".

use crc::{Algorithm, Crc};

use super::{Content, Flaw};

/// CRC-6 of BiSS: 0x43 without its highest bit, most significant bit first, inverted.
const CRC_6: Crc<u8> = Crc::<u8>::new(&Algorithm {
    width: 6,
    poly: 0x03,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0x3f,
    check: 0,
    residue: 0,
});
/// Its width.
const CRC_BITS: u32 = 6;
/// Error and warning.
const STATUS_BITS: u32 = 2;

/// The check sum of position, error and warning in the low bits. Zeros before them do not change it.
fn check_sum(content: u64) -> u64 {
    let [_, _, _, bytes @ ..] = content.to_be_bytes();
    CRC_6.checksum(&bytes).into()
}

/// Decodes 64 bits, the first in the highest, with a position of `bits` (1 to 32).
///
/// # Errors
/// The frame's flaw.
pub fn decode(received: u64, bits: u32) -> Result<Content, Flaw> {
    let rest = received.leading_ones();
    let answer = received.checked_shl(rest).unwrap_or(0);
    let start = rest + answer.leading_zeros();
    let length = bits.min(32) + STATUS_BITS + CRC_BITS;
    // Start and CDS come before the position, and at least one bit of the time-out behind it.
    if rest == 0 || start + 2 + length >= u64::BITS {
        return Err(Flaw::Line);
    }
    let aligned = received << (start + 2);
    if aligned << length != 0 {
        return Err(Flaw::Line);
    }
    let frame = aligned >> (u64::BITS - length);
    let content = frame >> CRC_BITS;
    if check_sum(content) != frame & ((1 << CRC_BITS) - 1) {
        return Err(Flaw::CheckSum);
    }
    if content & 0b10 == 0 {
        return Err(Flaw::Error);
    }
    Ok(Content {
        count: (content >> STATUS_BITS) as u32,
        warning: content & 0b01 == 0,
        start,
    })
}
