//! Where the last words of a firmware lie: memory that the start-up code leaves alone.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use quadrant::app::last_words::LastWords;

struct Remains(UnsafeCell<MaybeUninit<[u8; LastWords::BYTES]>>);

// SAFETY: it is read once at start-up, before anything can interrupt, and written on the way to `halt` with interrupts
// disabled.
unsafe impl Sync for Remains {}

// SAFETY: the section is the one that `cortex-m-rt` neither loads nor clears.
#[unsafe(link_section = ".uninit.last_words")]
static REMAINS: Remains = Remains(UnsafeCell::new(MaybeUninit::uninit()));

fn byte(index: usize) -> *mut u8 {
    debug_assert!(index < LastWords::BYTES);
    REMAINS.0.get().cast::<u8>().wrapping_add(index)
}

/// What the firmware before this one left, if it left anything; it is not there a second time.
pub(crate) fn take() -> Option<LastWords> {
    let mut record = [0; LastWords::BYTES];
    for (index, slot) in record.iter_mut().enumerate() {
        // SAFETY: inside the record. What lies there was written by nobody this program knows of: hence volatile.
        *slot = unsafe { byte(index).read_volatile() };
    }
    // SAFETY: as above.
    unsafe { byte(0).write_volatile(0) };
    LastWords::decode(&record)
}

/// Leaves last words.
pub(super) fn leave(words: &LastWords) {
    for (index, value) in words.encode().into_iter().enumerate() {
        // SAFETY: inside the record; read again by the next firmware only, hence volatile.
        unsafe { byte(index).write_volatile(value) };
    }
}
