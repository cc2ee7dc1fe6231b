//! The record that outlives a reset.

use proptest::prelude::*;
use quadrant::app::crash_record::{CrashCause, CrashRecord, TEXT_BYTES};

#[test]
fn last_words_survive() {
    let words = CrashRecord::new(
        CrashCause::Panic,
        4711,
        format_args!("panicked at {}", "src/main.rs:1:2"),
    );
    let read = CrashRecord::decode(&words.encode()).expect("a sound record");
    assert_eq!(read, words);
    assert_eq!(read.text(), "panicked at src/main.rs:1:2");
    assert_eq!((read.cause, read.tick), (CrashCause::Panic, 4711));
}

#[test]
fn the_record_keeps_its_layout() {
    let bytes = CrashRecord::new(CrashCause::HardFault, 0x0403_0201, "ab").encode();
    assert_eq!(
        bytes[..16],
        [
            b'Q', b'L', b'W', b'1', 1, 2, 3, 4, 2, 2, 0, 0, b'a', b'b', 0, 0
        ]
    );
    assert_eq!(bytes.len(), 252);
    assert_eq!(
        bytes[248..],
        [0x60, 0x01, 0x40, 0x03],
        "zlib's CRC-32 of the rest"
    );
}

#[test]
fn noise_is_no_record() {
    for byte in [0x00, 0xFF, 0xAA, 0xCC] {
        assert_eq!(CrashRecord::decode(&[byte; CrashRecord::BYTES]), None);
    }
}

#[test]
fn a_text_that_is_too_long_loses_its_end_and_no_half_character_is_left() {
    let long = "ä".repeat(TEXT_BYTES);
    let words = CrashRecord::new(CrashCause::Panic, 0, &long);
    assert_eq!(words.text().len(), TEXT_BYTES);
    let odd = CrashRecord::new(CrashCause::Panic, 0, format_args!("x{long}"));
    assert_eq!(odd.text().len(), TEXT_BYTES - 1);
    assert_eq!(odd.text(), format!("x{}", "ä".repeat((TEXT_BYTES - 1) / 2)));
    // What comes after the first piece that did not fit is lost too, even if it would fit.
    assert_eq!(CrashRecord::decode(&odd.encode()), Some(odd));
}

proptest! {
    #[test]
    fn a_record_with_a_wrong_bit_is_noise(at in 0..CrashRecord::BYTES * 8, text in ".{0,80}") {
        let mut bytes = CrashRecord::new(CrashCause::StrayInterrupt, 9, &text).encode();
        bytes[at / 8] ^= 1 << (at % 8);
        prop_assert_eq!(CrashRecord::decode(&bytes), None);
    }

    #[test]
    fn random_memory_is_no_record_and_no_panic(bytes in prop::collection::vec(any::<u8>(), CrashRecord::BYTES)) {
        let bytes: [u8; CrashRecord::BYTES] = bytes.try_into().unwrap();
        prop_assert_eq!(CrashRecord::decode(&bytes), None);
    }
}
