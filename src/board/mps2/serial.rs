//! The link's port: two rings in the memory shared with the host.
//!
//! Host and firmware run at their own pace, but a session is to be the same every time. So bytes are exchanged only when
//! a tick's inputs are taken ([`exchange`]): what the host has written by then can be read in this tick, and what the
//! firmware has written by then is shown to the host with this tick's outputs.

use core::sync::atomic::{AtomicU32, Ordering};

use quadrant::hal;
use quadrant_lockstep::{
    LINK_BYTES, LINK_IN, LINK_IN_TAKEN, LINK_IN_WRITTEN, LINK_OUT, LINK_OUT_SHOWN, LINK_OUT_TAKEN,
    Mode,
};

use super::mailbox;

/// Bytes of the host that may be read.
static ARRIVED: AtomicU32 = AtomicU32::new(0);
/// Bytes read.
static TAKEN: AtomicU32 = AtomicU32::new(0);
/// Bytes written.
static WRITTEN: AtomicU32 = AtomicU32::new(0);
/// Bytes that the host has read.
static GONE: AtomicU32 = AtomicU32::new(0);

/// Exchanges bytes. Not while the port is in use: the idle loop calls it, and the code that ends the emulator.
pub(super) fn exchange() {
    ARRIVED.store(mailbox::read(LINK_IN_WRITTEN), Ordering::Relaxed);
    GONE.store(mailbox::read(LINK_OUT_TAKEN), Ordering::Relaxed);
    mailbox::write(LINK_IN_TAKEN, TAKEN.load(Ordering::Relaxed));
    mailbox::write(LINK_OUT_SHOWN, WRITTEN.load(Ordering::Relaxed));
}

/// Empties the rings, which a firmware before this one has used.
pub(super) fn reset() {
    for word in [
        LINK_IN_WRITTEN,
        LINK_IN_TAKEN,
        LINK_OUT_SHOWN,
        LINK_OUT_TAKEN,
    ] {
        mailbox::write(word, 0);
    }
}

/// The link's port.
pub(crate) struct Serial {
    /// Only a host in lockstep has something to say.
    connected: bool,
}

impl Serial {
    pub(super) fn new(mode: Mode) -> Self {
        Self {
            connected: mode == Mode::Lockstep,
        }
    }
}

impl hal::Serial for Serial {
    fn read(&mut self, into: &mut [u8]) -> usize {
        if !self.connected {
            return 0;
        }
        let taken = TAKEN.load(Ordering::Relaxed);
        let waiting = ARRIVED.load(Ordering::Relaxed).wrapping_sub(taken) as usize;
        let count = waiting.min(into.len()).min(LINK_BYTES);
        for (at, byte) in (taken..).zip(into.iter_mut().take(count)) {
            *byte = mailbox::byte(LINK_IN + at as usize % LINK_BYTES);
        }
        TAKEN.store(taken.wrapping_add(count as u32), Ordering::Relaxed);
        count
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        if !self.connected {
            return bytes.len();
        }
        let written = WRITTEN.load(Ordering::Relaxed);
        let waiting = written.wrapping_sub(GONE.load(Ordering::Relaxed)) as usize;
        let count = LINK_BYTES.saturating_sub(waiting).min(bytes.len());
        for (at, byte) in (written..).zip(bytes.iter().take(count)) {
            mailbox::set_byte(LINK_OUT + at as usize % LINK_BYTES, *byte);
        }
        WRITTEN.store(written.wrapping_add(count as u32), Ordering::Relaxed);
        count
    }
}
