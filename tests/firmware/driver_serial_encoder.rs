//! Frames of serial encoders, made bit by bit as an encoder puts them out.

use proptest::prelude::*;
use quadrant::drivers::serial_encoder::times::SpiTimes;
use quadrant::drivers::serial_encoder::{
    BRIDGE_AFTER, Content, Flaw, FrameCounts, SerialEncoder, biss, ssi,
};
use quadrant_law::encoder::EncoderReading;
use quadrant_settings::leaves::{Range, find};
use quadrant_settings::{CheckBit, SerialProtocol, SerialSettings, StageSettings};
use quadrant_test_support::repeatable;

use super::board_wiring::{nucleo_f446re, nucleo_h743zi2};

/// The line's levels in the order of their bits, low behind them.
fn shifted_in(levels: &[u8]) -> u64 {
    assert!(levels.len() <= 64);
    levels
        .iter()
        .chain(core::iter::repeat(&0))
        .take(64)
        .fold(0, |word, level| word << 1 | u64::from(*level))
}

fn levels(value: u64, bits: u32) -> impl Iterator<Item = u8> {
    (0..bits).rev().map(move |bit| (value >> bit & 1) as u8)
}

/// The six stages of the shift register in data sheets of encoders with BiSS-C: x^6 + x + 1, the output inverted.
fn shift_register(levels: &[u8]) -> u64 {
    let mut stages = [0_u8; 6];
    for level in levels {
        let feedback = level ^ stages[5];
        stages = [
            feedback,
            stages[0] ^ feedback,
            stages[1],
            stages[2],
            stages[3],
            stages[4],
        ];
    }
    let inverted = stages.iter().rev().map(|stage| 1 - stage);
    inverted.fold(0, |word, bit| word << 1 | u64::from(bit))
}

/// A frame of BiSS-C.
#[derive(Clone, Copy, Debug)]
struct Frame {
    rest: usize,
    acknowledge: usize,
    cds: u8,
    count: u32,
    bits: u32,
    error: bool,
    warning: bool,
}

const FRAME: Frame = Frame {
    rest: 2,
    acknowledge: 3,
    cds: 0,
    count: 0x2_1234,
    bits: 26,
    error: false,
    warning: false,
};

impl Frame {
    fn shifted_in(&self) -> u64 {
        let mut content: Vec<u8> = levels(self.count.into(), self.bits).collect();
        content.extend([u8::from(!self.error), u8::from(!self.warning)]);
        let crc = shift_register(&content);
        let mut line = vec![1; self.rest];
        line.extend(vec![0; self.acknowledge]);
        line.extend([1, self.cds]);
        line.extend(content);
        line.extend(levels(crc, 6));
        shifted_in(&line)
    }
}

fn biss_c() -> SerialSettings {
    SerialSettings::default()
}

fn whole(count: u32) -> EncoderReading {
    EncoderReading::of(count)
}

fn with_count(count: u32) -> u64 {
    Frame { count, ..FRAME }.shifted_in()
}

/// An encoder that has sent enough whole frames at this count that one is bridged.
fn proven(settings: &SerialSettings, bits: u32, received: u64) -> SerialEncoder {
    let mut encoder = SerialEncoder::new(settings, bits);
    for _ in 0..=BRIDGE_AFTER {
        encoder.take(Some(received));
    }
    assert!(encoder.take(Some(received)).valid);
    encoder
}

#[test]
fn the_check_sum_is_that_of_published_vectors() {
    // Two bytes and cleared status bits give 0x1a, all of 0xfedcba (status 10) 0x32, and zeros 0x3f.
    let vectors = [(0x1234, 16, 0b00, 0x1a), (0x3f_b72e, 22, 0b10, 0x32)];
    for (count, bits, status, crc) in vectors {
        let mut content: Vec<u8> = levels(count, bits).collect();
        content.extend(levels(status, 2));
        assert_eq!(shift_register(&content), crc);
        let mut line = vec![1, 0, 1, 0];
        line.extend(content);
        line.extend(levels(crc, 6));
        let decoded = biss::decode(shifted_in(&line), bits);
        if status == 0 {
            assert_eq!(decoded, Err(Flaw::Error));
        } else {
            let expected = Content {
                count: count as u32,
                warning: true,
                start: 2,
            };
            assert_eq!(decoded, Ok(expected));
        }
    }
    assert_eq!(shift_register(&[0; 36]), 0x3f);
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn every_frame_comes_back(
        rest in 1_usize..6, acknowledge in 1_usize..12, cds in 0_u8..2, bits in 18_u32..=32, value: u32, warning: bool,
    ) {
        let count = value >> (32 - bits);
        let frame = Frame { rest, acknowledge, cds, count, bits, error: false, warning };
        let expected = Content { count, warning, start: (rest + acknowledge) as u32 };
        prop_assert_eq!(biss::decode(frame.shifted_in(), bits), Ok(expected));
        let failing = Frame { error: true, ..frame };
        prop_assert_eq!(biss::decode(failing.shifted_in(), bits), Err(Flaw::Error));
    }

    #[test]
    fn whatever_comes_is_decoded_or_refused(received: u64, bits: u32) {
        // No panic, and no count beyond its width.
        let decoded = [biss::decode(received, bits), ssi::decode(received, bits, true, CheckBit::OddParity)];
        for content in decoded.into_iter().flatten() {
            prop_assert!(bits >= 32 || u64::from(content.count) < 1 << bits);
        }
    }

    #[test]
    fn one_or_two_wrong_bits_never_become_another_count(value: u32, bits in 18_u32..=32, acknowledge in 1_usize..5) {
        let count = value >> (32 - bits);
        let frame = Frame { count, bits, acknowledge, ..FRAME }.shifted_in();
        let mut known = SerialEncoder::new(&biss_c(), bits);
        known.take(Some(frame));
        prop_assert_eq!(known.take(Some(frame)), whole(count));
        for first in 0..64 {
            for second in first..64 {
                let wrong = if first == second { 1 << first } else { 1 << first | 1_u64 << second };
                let reading = known.clone().take(Some(frame ^ wrong));
                // A bit at rest, of the acknowledge or CDS may be wrong without harm.
                prop_assert!(!reading.valid || reading.count == count, "{wrong:#x}");
            }
        }
    }

    #[test]
    fn one_wrong_bit_of_a_word_with_parity_is_found(value: u32, bits in 18_u32..=32, odd: bool) {
        let count = value >> (32 - bits);
        let check = if odd { CheckBit::OddParity } else { CheckBit::EvenParity };
        let word = word(count, bits, Some(u8::from((count.count_ones() % 2 == 1) != odd)));
        prop_assert_eq!(ssi::decode(word, bits, false, check).map(|content| content.count), Ok(count));
        // The bits of rest, position and parity, and the one behind them.
        for place in 0..bits + 3 {
            prop_assert!(ssi::decode(word ^ 1 << (63 - place), bits, false, check).is_err(), "{place}");
        }
    }
}

#[test]
fn a_frame_that_does_not_fit_or_a_dead_line_is_no_frame() {
    for bits in [18, 26, 32] {
        assert_eq!(biss::decode(0, bits), Err(Flaw::Line));
        assert_eq!(biss::decode(u64::MAX, bits), Err(Flaw::Line));
    }
    // The last bit must show the time-out.
    let late = |acknowledge| Frame {
        acknowledge,
        ..FRAME
    };
    let room = 64 - (2 + 2 + 26 + 8 + 1);
    assert!(biss::decode(late(room).shifted_in(), 26).is_ok());
    let cut = late(room + 1).shifted_in();
    assert_eq!(biss::decode(cut, 26), Err(Flaw::Line));
    // Cut off in the middle of the frame: the wire breaks and the receiver shows high, or low.
    let frame = with_count(0x155_5555);
    for place in 6..38 {
        let behind = u64::MAX >> place;
        assert!(biss::decode(frame | behind, 26).is_err(), "{place}");
        let low = biss::decode(frame & !behind, 26);
        assert_ne!(low.map(|content| content.count).unwrap_or(0x155_5555), 0);
    }
}

#[test]
fn all_ones_and_all_zeros_are_counts_like_others() {
    for count in [0, 0x3ff_ffff] {
        let decoded = biss::decode(with_count(count), 26);
        assert_eq!(decoded.map(|content| content.count), Ok(count));
        let decoded = ssi::decode(word(count, 26, None), 26, false, CheckBit::None);
        assert_eq!(decoded.map(|content| content.count), Ok(count));
    }
}

#[test]
fn a_reading_is_valid_from_the_second_frame_on() {
    let mut encoder = SerialEncoder::new(&biss_c(), 26);
    assert!(!encoder.take(Some(with_count(7))).valid);
    assert_eq!(encoder.take(Some(with_count(8))), whole(8));
    assert_eq!(encoder.age(), 0);
}

#[test]
fn one_damaged_frame_goes_on_with_the_last_step_across_the_wrap() {
    let mut encoder = proven(&biss_c(), 26, with_count(0x3ff_fff0));
    assert_eq!(
        encoder.take(Some(with_count(0x3ff_fffa))),
        whole(0x3ff_fffa)
    );
    // Ten counts on.
    assert_eq!(encoder.take(Some(with_count(9) ^ 1 << 30)), whole(4));
    assert_eq!(encoder.age(), 1);
    assert_eq!(encoder.take(Some(with_count(14))), whole(14));
    let expected = FrameCounts {
        check_sum: 1,
        bridged: 1,
        ..FrameCounts::default()
    };
    assert_eq!(encoder.counts(), expected);
}

#[test]
fn a_second_damaged_frame_is_not_bridged_before_many_whole_ones() {
    let damaged = Some(with_count(5) ^ 1 << 30);
    let good = Some(with_count(5));
    let mut encoder = proven(&biss_c(), 26, with_count(5));
    assert!(encoder.take(damaged).valid);
    assert!(!encoder.take(damaged).valid, "in a row");
    for _ in 0..BRIDGE_AFTER - 1 {
        assert!(encoder.take(good).valid);
    }
    assert!(!encoder.take(damaged).valid, "one frame too early");
    for _ in 0..BRIDGE_AFTER {
        assert!(encoder.take(good).valid);
    }
    assert!(encoder.take(damaged).valid);
}

#[test]
fn the_encoders_own_error_is_never_bridged_and_its_warning_is_counted() {
    let mut encoder = proven(&biss_c(), 26, FRAME.shifted_in());
    let warning = Frame {
        warning: true,
        ..FRAME
    };
    assert_eq!(encoder.take(Some(warning.shifted_in())), whole(FRAME.count));
    let failing = Frame {
        error: true,
        count: 0,
        ..FRAME
    };
    let reading = encoder.take(Some(failing.shifted_in()));
    // The count stays.
    let expected = EncoderReading {
        valid: false,
        ..whole(FRAME.count)
    };
    assert_eq!(reading, expected);
    let counts = encoder.counts();
    assert_eq!((counts.errors, counts.warnings, counts.bridged), (1, 1, 0));
}

#[test]
fn a_frame_that_did_not_come_in_time_is_not_fresh() {
    let mut encoder = proven(&biss_c(), 26, FRAME.shifted_in());
    let expected = EncoderReading {
        fresh: false,
        ..whole(FRAME.count)
    };
    assert_eq!(encoder.take(None), expected);
    assert_eq!(encoder.take(None), expected);
    assert_eq!((encoder.counts().late, encoder.age()), (2, 2));
}

#[test]
fn an_encoder_that_acknowledges_for_longer_than_before_is_believed_the_second_time() {
    let mut encoder = proven(&biss_c(), 26, FRAME.shifted_in());
    let later = Frame {
        acknowledge: 4,
        count: FRAME.count + 1,
        ..FRAME
    };
    // The first is bridged.
    assert_eq!(encoder.take(Some(later.shifted_in())), whole(FRAME.count));
    assert_eq!(
        encoder.take(Some(later.shifted_in())),
        whole(FRAME.count + 1)
    );
}

/// A word of SSI: rest, position, a check bit, and low until the monoflop ends.
fn word(value: u32, bits: u32, check: Option<u8>) -> u64 {
    let mut line = vec![1];
    line.extend(levels(value.into(), bits));
    line.extend(check);
    shifted_in(&line)
}

#[test]
fn gray_code_changes_one_bit_from_number_to_number() {
    // From the definition: neighbours differ in one bit, and all numbers are met once, around the end too.
    let mut gray = 0_u32;
    for number in 0..1_u32 << 18 {
        assert_eq!(ssi::from_gray(gray), number);
        gray ^= 1 << (number + 1).trailing_zeros().min(17);
    }
    assert_eq!(gray, 0, "around");
    assert_eq!(ssi::from_gray(u32::MAX), 0xaaaa_aaaa);
}

#[test]
fn a_word_of_ssi_is_read_in_binary_and_in_gray() {
    for bits in 18..=32 {
        let number = 0x9234_5678_u32 >> (32 - bits);
        let binary = ssi::decode(word(number, bits, None), bits, false, CheckBit::None);
        assert_eq!(binary.map(|content| content.count), Ok(number));
        // The reflected code of a number is the sum without carry of it and its half.
        let gray = ssi::decode(
            word(number ^ (number / 2), bits, None),
            bits,
            true,
            CheckBit::None,
        );
        assert_eq!(gray.map(|content| content.count), Ok(number));
    }
}

#[test]
fn a_broken_wire_of_ssi_shows_at_rest_or_behind_the_word() {
    for check in [CheckBit::None, CheckBit::EvenParity, CheckBit::Error] {
        for gray in [false, true] {
            assert_eq!(ssi::decode(0, 25, gray, check), Err(Flaw::Line));
            assert_eq!(ssi::decode(u64::MAX, 25, gray, check), Err(Flaw::Line));
        }
    }
    let settings = SerialSettings {
        protocol: SerialProtocol::Ssi,
        gray: true,
        ..SerialSettings::default()
    };
    let mut encoder = proven(&settings, 25, word(1234, 25, None));
    let last = encoder.take(Some(word(1234, 25, None))).count;
    assert_eq!(encoder.take(Some(u64::MAX)), whole(last), "bridged");
    assert!(!encoder.take(Some(u64::MAX)).valid);
    assert_eq!(encoder.counts().line, 2);
}

#[test]
fn the_bytes_of_a_frame_hold_it() {
    let ssi = SerialSettings {
        protocol: SerialProtocol::Ssi,
        ..SerialSettings::default()
    };
    for bits in 18..=32 {
        assert_eq!(biss_c().frame_bytes(bits), 8);
        let needed = 1 + bits + 1 + 1;
        let clocked = 8 * ssi.frame_bytes(bits) as u8;
        assert!((needed..needed + 8).contains(&clocked));
    }
}

/// A board's clocks, and those of an encoder at most 10, 5.625, 3 and 1 MHz, MHz; the age of the position at 3 MHz, us; rates, Hz.
type OfBoard = (SpiTimes, [f64; 4], f64, [f64; 3]);

/// 65 bits, of which the first is the SPI's start, at 2.8125 and 3 MHz, and 2 us.
const BOARDS: [OfBoard; 2] = [
    (
        nucleo_f446re::SERIAL_TIMES,
        [5.625, 5.625, 2.8125, 0.703_125],
        25.11,
        [2500.0, 10e3, 15e3],
    ),
    (
        nucleo_h743zi2::SERIAL_TIMES,
        [6.0, 3.0, 3.0, 0.75],
        23.67,
        [2500.0, 10e3, 20e3],
    ),
];

#[test]
fn a_boards_clock_is_the_next_below_and_the_position_has_its_age() {
    for (times, clocks_mhz, age_us, _) in BOARDS {
        let clock_mhz = |clock_hz| {
            let settings = SerialSettings {
                clock_hz,
                ..biss_c()
            };
            1e-6 * f64::from(times.spi_hz) / f64::from(2 << times.rate(&settings))
        };
        assert_eq!([1e7, 5.625e6, 3e6, 1e6].map(clock_mhz), clocks_mhz);
        let lead = f64::from(times.lead_cycles(&biss_c(), 26));
        let age = lead / f64::from(times.timer_hz) * 1e6;
        assert!((age - age_us).abs() < 0.01, "{age}");
    }
}

#[test]
fn a_frame_at_any_clock_has_come_before_the_tick_and_leaves_the_encoder_time_to_rest() {
    let ssi = SerialSettings {
        protocol: SerialProtocol::Ssi,
        ..biss_c()
    };
    for (times, _, _, rates_hz) in BOARDS {
        for (settings, bits) in [(biss_c(), 32), (ssi, 18), (ssi, 32)] {
            for rate_hz in rates_hz {
                let mut stage = StageSettings {
                    rate_hz,
                    ..StageSettings::simulated()
                };
                stage.axes[0].encoder.counter_bits = bits;
                stage.axes[0].encoder.serial = Some(settings);
                let leaf = find("/axes/x/encoder/serial/clock_hz").expect("a setting");
                let Range::Number(least, _) = leaf.range else {
                    panic!("no number");
                };
                // At the slowest clock that is allowed, and just below one of the board's.
                let least_hz = least.value(&stage, 0);
                for clock_hz in [least_hz, least_hz * 1.5, least_hz * 1.99] {
                    let settings = SerialSettings {
                        clock_hz,
                        ..settings
                    };
                    let of = || format!("{rate_hz} {settings:?} {bits}");
                    let bit_s = f64::from(2 << times.rate(&settings)) / f64::from(times.spi_hz);
                    let frame_s = 8.0 * settings.frame_bytes(bits) as f64 * bit_s;
                    assert!(frame_s * rate_hz < 0.701, "{}", of());
                    let lead = times.lead_cycles(&settings, bits);
                    let lead_s = f64::from(lead) / f64::from(times.timer_hz);
                    // The SPI starts within a bit; DMA and clocks take some hundred nanoseconds.
                    assert!(lead_s > frame_s + bit_s + 1.9e-6, "{}", of());
                    assert!(lead_s * rate_hz < 0.8, "{}", of());
                }
            }
        }
    }
}
