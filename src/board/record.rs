//! Records that outlast a restart: memory that the start-up code leaves alone.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// The place of a record of `N` bytes, in a section that `cortex-m-rt` neither loads nor clears.
pub(super) struct Record<const N: usize>(UnsafeCell<MaybeUninit<[u8; N]>>);

// SAFETY: a record is read once at start-up, before anything can interrupt, and written by one task or on the way to a restart;
// each byte by itself.
unsafe impl<const N: usize> Sync for Record<N> {}

impl<const N: usize> Record<N> {
    pub(super) const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    fn byte(&self, index: usize) -> *mut u8 {
        debug_assert!(index < N);
        self.0.get().cast::<u8>().wrapping_add(index)
    }

    /// The bytes that the firmware before this one left, or any.
    pub(super) fn read(&self) -> [u8; N] {
        // SAFETY: inside the record; every content of the memory is a byte, and volatile, as no Rust code has written it.
        core::array::from_fn(|index| unsafe { self.byte(index).read_volatile() })
    }

    /// Leaves bytes for the next firmware.
    pub(super) fn write(&self, bytes: [u8; N]) {
        for (index, value) in bytes.into_iter().enumerate() {
            self.write_byte(index, value);
        }
    }

    /// Leaves one byte for the next firmware.
    pub(super) fn write_byte(&self, index: usize, value: u8) {
        // SAFETY: inside the record; read again by the next firmware only, hence volatile.
        unsafe { self.byte(index).write_volatile(value) };
    }
}
