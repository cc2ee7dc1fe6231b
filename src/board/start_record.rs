//! The start record's place.

use quadrant::app::start_record::StartRecord;

use super::record::Record;

// SAFETY: the section is the one that `cortex-m-rt` neither loads nor clears.
#[unsafe(link_section = ".uninit.start_record")]
static RECORD: Record<{ StartRecord::BYTES }> = Record::new();

/// Reads the record of the firmware before this one.
pub(crate) fn read() -> StartRecord {
    StartRecord::decode(RECORD.read())
}

/// Writes the record for the next start.
pub(crate) fn write(record: StartRecord) {
    RECORD.write(record.encode());
}
