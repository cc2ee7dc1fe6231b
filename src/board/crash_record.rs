//! The crash record's place.

use quadrant::app::crash_record::CrashRecord;

use super::record::Record;

// SAFETY: the section is the one that `cortex-m-rt` neither loads nor clears.
#[unsafe(link_section = ".uninit.crash_record")]
static RECORD: Record<{ CrashRecord::BYTES }> = Record::new();

/// Takes the record of the firmware before this one, if there is one.
pub(crate) fn take() -> Option<CrashRecord> {
    let record = RECORD.read();
    RECORD.write_byte(0, 0);
    CrashRecord::decode(&record)
}

/// Writes the record.
pub(super) fn write(record: &CrashRecord) {
    RECORD.write(record.encode());
}
