//! Model of an absolute encoder with BiSS-C, point to point: MA and SLO.
//!
//! Written from the protocol's description and iC-Haus' data sheet of the iC-MU, without reading this project's driver. It sees bytes,
//! not edges: the levels of SLO at MA's rising edges, eight at a time. Every violated time is a complaint.

use std::sync::{Arc, Mutex, MutexGuard};

use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};

/// Time-out after MA's last edge, ns: SLO is low until then.
const TIME_OUT_NS: u64 = 20_000;
/// Shortest period of MA, ns.
const MA_NS: u64 = 100;
/// Bits of position.
const BITS: u32 = 26;
/// Rising edges of MA that see SLO high: it falls at the second.
const REST_BITS: u32 = 2;
/// Rising edges that see it low: the acknowledge, as long as the encoder computes.
const ACKNOWLEDGE_BITS: u32 = 6;

/// Flaw of encoder or cable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flaw {
    /// Nothing.
    #[default]
    None,
    /// So many frames have a wrong bit.
    WrongBits(u32),
    /// SLO is not connected: the receiver shows high.
    High,
    /// SLO is not connected: the receiver shows low.
    Low,
    /// The encoder reports an error.
    Error,
    /// The encoder warns.
    Warning,
}

/// The encoder.
#[derive(Debug, Default)]
pub struct Encoder {
    /// Position, of which the lowest bits are sent.
    pub count: i64,
    /// Flaw.
    pub flaw: Flaw,
    frame: u64,
    /// End of the last byte, ns.
    last_ns: u64,
    /// Instant of the last position, ns.
    pub latched_ns: u64,
    /// Frames so far.
    pub frames: u64,
    /// Those of them with the encoder's error.
    pub errors: u64,
    /// Complaints: time in ns, text; the first 20.
    pub complaints: Vec<(u64, String)>,
}

impl Encoder {
    /// Eight bits of SLO.
    fn byte(&mut self, now: u64) -> u32 {
        let since = now - self.last_ns;
        // The first byte of a frame is that after a rest.
        if since > TIME_OUT_NS {
            self.begin(now);
        } else if since < 8 * MA_NS {
            self.complain(now, format!("a byte in {since} ns"));
        }
        self.last_ns = now;
        let byte = (self.frame >> 56) as u32;
        self.frame <<= 8;
        match self.flaw {
            Flaw::High => 0xFF,
            Flaw::Low => 0,
            _ => byte,
        }
    }

    fn begin(&mut self, now: u64) {
        // MA must have rested for the time-out before this byte began, which took eight bits, 4 us at most here.
        if self.frames > 0 && now - self.last_ns < TIME_OUT_NS + 8 * 500 {
            self.complain(now, "MA begins within the time-out");
        }
        self.frames += 1;
        self.errors += u64::from(self.flaw == Flaw::Error);
        self.latched_ns = now;
        let status =
            u64::from(self.flaw != Flaw::Error) << 1 | u64::from(self.flaw != Flaw::Warning);
        let position = self.count as u64 & ((1 << BITS) - 1);
        let content = position << 2 | status;
        // x^6 + x + 1, inverted.
        let mut crc = 0;
        for bit in (0..BITS + 2).rev() {
            let feedback = (crc >> 5 ^ content >> bit) & 1;
            crc = (crc << 1 & 0x3F) ^ feedback * 0b11;
        }
        let frame = (1_u64 << 1) << (BITS + 8) | content << 6 | (crc ^ 0x3F);
        let length = 2 + BITS + 8;
        let rest = ((1 << REST_BITS) - 1) << (64 - REST_BITS);
        self.frame = rest | frame << (64 - REST_BITS - ACKNOWLEDGE_BITS - length);
        if let Flaw::WrongBits(left) = &mut self.flaw {
            // Three bits of the position: more than the check sum is sure to find.
            self.frame ^= 0b1011 << 40;
            *left -= 1;
            if *left == 0 {
                self.flaw = Flaw::None;
            }
        }
    }

    fn complain(&mut self, now: u64, text: impl Into<String>) {
        if self.complaints.len() < 20 {
            self.complaints.push((now, text.into()));
        }
    }
}

/// The encoder, shared by its wires and the scenario.
pub type SharedEncoder = Arc<Mutex<Encoder>>;

/// The encoder behind the lock, also after a panic elsewhere.
pub fn lock(encoder: &SharedEncoder) -> MutexGuard<'_, Encoder> {
    encoder
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The encoder's end of its cable.
#[derive(Debug)]
pub struct CableEnd(pub SharedEncoder);

impl Store for CableEnd {
    fn store(&self, _: &mut Writer) -> Result<(), Error> {
        Ok(())
    }

    fn load(&mut self, _: &mut Reader) -> Result<(), Error> {
        Ok(())
    }
}

impl Peer for CableEnd {
    fn transfer(&mut self, _: u32, _: u8, context: &mut Timeline<'_, '_>) -> u32 {
        lock(&self.0).byte(context.now().0)
    }
}
