//! The log's buffer in RAM (RTT), emptied for the link while no debug probe does it.
//!
//! `defmt-rtt` fills it, and drops what does not fit. Its control block is that of SEGGER's protocol, which probes look for.

use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};

/// Mode that a probe sets while it reads.
const READ_BY_PROBE: u32 = 2;
/// The bits of the mode.
const MODE: u32 = 0b11;

#[repr(C)]
struct Channel {
    name: *const u8,
    buffer: *const u8,
    size: u32,
    write: AtomicU32,
    read: AtomicU32,
    flags: AtomicU32,
}

#[repr(C)]
struct ControlBlock {
    id: [u8; 16],
    up_channels: u32,
    down_channels: u32,
    log: Channel,
}

unsafe extern "C" {
    /// Of `defmt-rtt`.
    static _SEGGER_RTT: ControlBlock;
}

/// Takes the oldest bytes of the log: as many as there are, fit, and lie in one piece. Before the buffer is three quarters full only if a host
/// has asked, so that a probe that comes later sees the start, and never while a probe reads. One that is fuller is read by no probe, whatever
/// its mode says: it has left without setting it back.
pub(crate) fn take(into: &mut [u8], asked: bool) -> usize {
    // SAFETY: `defmt-rtt` defines it, and what changes in it is atomic.
    let log = unsafe { &_SEGGER_RTT.log };
    let (size, read) = (log.size as usize, log.read.load(Ordering::Relaxed) as usize);
    let write = log.write.load(Ordering::Acquire) as usize;
    if read >= size || write >= size {
        return 0;
    }
    let (end, waiting) = if write < read {
        (size, size - read + write)
    } else {
        (write, write - read)
    };
    let read_by_probe = log.flags.load(Ordering::Relaxed) & MODE == READ_BY_PROBE;
    if (read_by_probe || !asked) && 4 * waiting < 3 * size {
        return 0;
    }
    let count = into.len().min(end - read);
    for (offset, place) in into.iter_mut().take(count).enumerate() {
        // SAFETY: below `size`, and written before `write` has passed it.
        *place = unsafe { ptr::read_volatile(log.buffer.add(read + offset)) };
    }
    let next = if read + count == size {
        0
    } else {
        read + count
    };
    log.read.store(next as u32, Ordering::Release);
    count
}
