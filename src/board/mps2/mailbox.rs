//! The firmware's side of the memory shared with the host.

use core::sync::atomic::{Ordering, fence};

use quadrant_lockstep::{
    BASE, BOOT, BootBlock, JOB, MEMORY_BYTES, Mode, OUTPUT, RECORDED_TICKS, RESET, Reset,
};

/// The run that the host asked for.
#[derive(Clone, Copy)]
pub(super) struct Boot {
    /// The source of the control interrupt.
    pub(super) mode: Mode,
    /// Number of ticks to run; in lockstep the host decides and this is zero.
    pub(super) ticks: u32,
    /// The job as the host encoded it.
    pub(super) job: &'static [u8],
}

/// Reads a word.
#[inline(always)]
pub(super) fn read(offset: usize) -> u32 {
    debug_assert!(offset.is_multiple_of(4) && offset < MEMORY_BYTES);
    // SAFETY: an aligned address inside the PSRAM, which no Rust object occupies; the host may write to it at any
    // time, hence volatile.
    unsafe { core::ptr::read_volatile((BASE + offset) as *const u32) }
}

/// Writes a word.
#[inline(always)]
pub(super) fn write(offset: usize, word: u32) {
    debug_assert!(offset.is_multiple_of(4) && offset < MEMORY_BYTES);
    // SAFETY: as in `read`.
    unsafe { core::ptr::write_volatile((BASE + offset) as *mut u32, word) }
}

/// True if the last outputs reported to the host are enabled.
pub(super) fn is_enabled() -> bool {
    read(OUTPUT + 4) >> 16 & 1 == 1
}

/// Reads a byte.
pub(super) fn byte(offset: usize) -> u8 {
    debug_assert!(offset < MEMORY_BYTES);
    // SAFETY: as in `read`; a byte is always aligned.
    unsafe { core::ptr::read_volatile((BASE + offset) as *const u8) }
}

/// Writes a byte.
pub(super) fn set_byte(offset: usize, byte: u8) {
    debug_assert!(offset < MEMORY_BYTES);
    // SAFETY: as in `byte`.
    unsafe { core::ptr::write_volatile((BASE + offset) as *mut u8, byte) }
}

/// Reads a sequence number; what it announces can be read after it.
#[inline(always)]
pub(super) fn read_sequence(offset: usize) -> u32 {
    let sequence = read(offset);
    fence(Ordering::Acquire);
    sequence
}

/// Writes a sequence number; what it announces was written before it.
#[inline(always)]
pub(super) fn write_sequence(offset: usize, sequence: u32) {
    fence(Ordering::Release);
    write(offset, sequence);
}

/// Takes the cause of the processor's reset; the next call returns [`Reset::PowerOn`].
pub(super) fn take_reset() -> Reset {
    let reset = Reset::from_word(read(RESET));
    write(RESET, Reset::PowerOn as u32);
    reset
}

/// Reads the boot block. Panics when no host has written one, or one that makes no sense.
pub(super) fn boot() -> Boot {
    let mut bytes = [0; BootBlock::BYTES];
    for (index, word) in bytes.chunks_exact_mut(4).enumerate() {
        word.copy_from_slice(&read(BOOT + 4 * index).to_le_bytes());
    }
    let Some(block) = BootBlock::decode(&bytes) else {
        panic!("no host has prepared the memory: start this image with `cargo xtask emulate`");
    };
    assert!(
        block.mode == Mode::Lockstep || (1..=RECORDED_TICKS).contains(&(block.ticks as usize)),
        "{} ticks asked for, but a record holds 1 to {RECORDED_TICKS}",
        block.ticks
    );
    // SAFETY: inside the PSRAM, as the block's decoding has checked the length; the host writes the job before it
    // starts the machine and not again while it runs.
    let job =
        unsafe { core::slice::from_raw_parts((BASE + JOB) as *const u8, block.job_bytes as usize) };
    Boot {
        mode: block.mode,
        ticks: block.ticks,
        job,
    }
}
