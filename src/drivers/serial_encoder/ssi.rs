//! A word of SSI.
//!
//! ```text
//! clock ‾‾|_|‾|_|‾|_|‾ ...                      ‾‾‾‾‾‾‾‾
//! data  ‾‾‾‾‾‾|     |                |        |_______|‾‾
//!         rest  position, MSB first .. check     low
//! ```
//!
//! Both lines rest high. The first falling edge of the clock latches the position, and each rising edge puts out a bit. The master
//! samples at rising edges, just before that happens: first the line at rest, which is high. Behind the last bit the line is low until the encoder's
//! monoflop ends (10 to 40 us after the clock's last edge): a line that rests at either level is found in every word. Where the word
//! comes again in a ring, it does so behind that bit, and is not read.
//!
//! SSI has no check sum: a wrong bit of the position shows as a jump to the law, or not at all. Parity finds one.
//!
//! Source: Max Stegmann GmbH, DE 34 45 617; data sheets of encoders with SSI.

use super::{CheckBit, Content, Flaw};

/// The number whose Gray code `gray` is.
pub const fn from_gray(gray: u32) -> u32 {
    let mut number = gray;
    number ^= number >> 1;
    number ^= number >> 2;
    number ^= number >> 4;
    number ^= number >> 8;
    number ^ number >> 16
}

/// Decodes 64 bits, the first in the highest, with a position of `bits` (1 to 32).
///
/// # Errors
/// The word's flaw.
pub const fn decode(
    received: u64,
    bits: u32,
    gray: bool,
    check: CheckBit,
) -> Result<Content, Flaw> {
    let bits = if bits < 32 { bits } else { 32 };
    let length = match check {
        CheckBit::None => bits,
        CheckBit::EvenParity | CheckBit::OddParity | CheckBit::Error => bits + 1,
    };
    // The bit at rest, the word, and the line's level behind it.
    let is_framed = received >> 63 == 1 && received >> (62 - length) & 1 == 0;
    if !is_framed {
        return Err(Flaw::Line);
    }
    let word = received << 1 >> (64 - length);
    let odd = word.count_ones() & 1 == 1;
    let raw = match check {
        CheckBit::None => word,
        CheckBit::EvenParity if odd => return Err(Flaw::CheckSum),
        CheckBit::OddParity if !odd => return Err(Flaw::CheckSum),
        CheckBit::Error if word & 1 == 1 => return Err(Flaw::Error),
        CheckBit::EvenParity | CheckBit::OddParity | CheckBit::Error => word >> 1,
    };
    let raw = raw as u32;
    Ok(Content {
        count: if gray { from_gray(raw) } else { raw },
        warning: false,
        start: 1,
    })
}
