//! The start record's place: memory that the start-up code leaves alone.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use quadrant::app::start_record::StartRecord;

struct Record(UnsafeCell<MaybeUninit<[u8; StartRecord::BYTES]>>);

// SAFETY: it is read once at start-up, before anything can interrupt, and written there, by one task, and on the way to a
// restart; each byte by itself.
unsafe impl Sync for Record {}

// SAFETY: the section is the one that `cortex-m-rt` neither loads nor clears.
#[unsafe(link_section = ".uninit.start_record")]
static RECORD: Record = Record(UnsafeCell::new(MaybeUninit::uninit()));

fn byte(index: usize) -> *mut u8 {
    debug_assert!(index < StartRecord::BYTES);
    RECORD.0.get().cast::<u8>().wrapping_add(index)
}

/// Reads the record of the firmware before this one.
pub(crate) fn read() -> StartRecord {
    let mut record = [0; StartRecord::BYTES];
    for (index, slot) in record.iter_mut().enumerate() {
        // SAFETY: inside the record; every content of the memory is a byte, and volatile, as no Rust code has written it.
        *slot = unsafe { byte(index).read_volatile() };
    }
    StartRecord::decode(record)
}

/// Writes the record for the next start.
pub(crate) fn write(record: StartRecord) {
    for (index, value) in record.encode().into_iter().enumerate() {
        // SAFETY: inside the record.
        unsafe { byte(index).write_volatile(value) };
    }
}
