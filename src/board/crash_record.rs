//! The crash record's place: memory that the start-up code leaves alone.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use quadrant::app::crash_record::CrashRecord;

struct Record(UnsafeCell<MaybeUninit<[u8; CrashRecord::BYTES]>>);

// SAFETY: it is read once at start-up, before anything can interrupt, and written on the way to `halt` with interrupts
// disabled.
unsafe impl Sync for Record {}

// SAFETY: the section is the one that `cortex-m-rt` neither loads nor clears.
#[unsafe(link_section = ".uninit.crash_record")]
static RECORD: Record = Record(UnsafeCell::new(MaybeUninit::uninit()));

fn byte(index: usize) -> *mut u8 {
    debug_assert!(index < CrashRecord::BYTES);
    RECORD.0.get().cast::<u8>().wrapping_add(index)
}

/// Takes the record of the firmware before this one, if there is one.
pub(crate) fn take() -> Option<CrashRecord> {
    let mut record = [0; CrashRecord::BYTES];
    for (index, slot) in record.iter_mut().enumerate() {
        // SAFETY: inside the record. What lies there was written by nobody this program knows of: hence volatile.
        *slot = unsafe { byte(index).read_volatile() };
    }
    // SAFETY: as above.
    unsafe { byte(0).write_volatile(0) };
    CrashRecord::decode(&record)
}

/// Writes the record.
pub(super) fn write(record: &CrashRecord) {
    for (index, value) in record.encode().into_iter().enumerate() {
        // SAFETY: inside the record; read again by the next firmware only, hence volatile.
        unsafe { byte(index).write_volatile(value) };
    }
}
