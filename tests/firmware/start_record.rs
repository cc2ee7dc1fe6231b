//! Starts that do not last.

use quadrant::app::start_record::{MOST_STARTS, StartRecord};

fn after_reset(record: StartRecord, crashed: bool) -> StartRecord {
    StartRecord::decode(record.encode()).begin(crashed)
}

#[test]
fn three_starts_that_crash_set_the_stored_settings_aside_at_the_fourth() {
    let mut record = StartRecord::decode([0xA5; StartRecord::BYTES]).begin(false);
    for start in 1..=MOST_STARTS {
        assert!(!record.is_safe_start(), "start {start}");
        record = after_reset(record, true);
    }
    assert!(record.is_safe_start());
    // And so it stays until a start lasts, or one was asked for.
    assert!(after_reset(record, true).is_safe_start());
    assert!(!after_reset(record, false).is_safe_start());
    assert!(!after_reset(StartRecord::default(), true).is_safe_start());
}

#[test]
fn noise_is_no_record() {
    let record = (0..9).fold(StartRecord::default(), |record, _| record.begin(true));
    assert!(record.is_safe_start());
    for byte in 0..6 {
        for bit in 0..8 {
            let mut bytes = record.encode();
            bytes[byte] ^= 1 << bit;
            assert_eq!(StartRecord::decode(bytes), StartRecord::default());
        }
    }
}
