//! Counters that wrap, counts that do not.

use proptest::prelude::*;
use quadrant_law::encoder::{Encoder, EncoderState};
use quadrant_law::units::EncoderCount;

use quadrant_test_support::repeatable;

/// The reading of a counter of `bits` at a true count.
fn counter(count: i64, bits: u32) -> u32 {
    (count as u64 & ((1 << bits) - 1)) as u32
}

/// Takes a reading; true if the axis can have moved that far.
fn takes(encoder: &Encoder, state: &mut EncoderState, raw: u32) -> bool {
    let counts = encoder.accumulate(state, raw);
    encoder.is_plausible(counts)
}

proptest! {
    #![proptest_config(repeatable(500))]

    #[test]
    fn wraps_are_invisible_at_any_width(
        bits in 8u32..=32,
        start in any::<i32>(),
        moves in prop::collection::vec(-1.0f64..1.0, 1..200),
        reversed in any::<bool>(),
        garbage in any::<u32>(),
    ) {
        let largest = (1i64 << (bits - 1)) - 1;
        let encoder = Encoder::new(bits, reversed, largest as i32);
        let mut state = EncoderState::default();
        let mut truth = i64::from(start);
        // Bits above the counter's own may hold anything.
        let above = if bits == 32 { 0 } else { garbage << bits };
        prop_assert!(takes(&encoder, &mut state, counter(truth, bits) | above));
        for share in moves {
            truth += (share * largest as f64) as i64;
            prop_assert!(takes(&encoder, &mut state, counter(truth, bits) | above));
            let travelled = truth - i64::from(start);
            let expected = if reversed { -travelled } else { travelled };
            prop_assert_eq!(state.count(), EncoderCount(expected));
        }
    }

    #[test]
    fn a_step_is_plausible_up_to_the_limit_and_not_beyond(
        bits in 8u32..=32,
        start in any::<u32>(),
        limit in 1i64..120,
        step in -127i64..=127,
    ) {
        let encoder = Encoder::new(bits, false, limit as i32);
        let mut state = EncoderState::default();
        takes(&encoder, &mut state, start);
        let plausible = takes(&encoder, &mut state, counter(i64::from(start) + step, bits));
        prop_assert_eq!(plausible, step.abs() <= limit);
        // Counted all the same: the position is not lost.
        prop_assert_eq!(state.count(), EncoderCount(step));
    }

    #[test]
    fn no_reading_panics(bits in 1u32..=32, readings in prop::collection::vec(any::<u32>(), 50)) {
        for reversed in [false, true] {
            let encoder = Encoder::new(bits, reversed, 100);
            let mut state = EncoderState::default();
            for &raw in &readings {
                let before = state.count();
                let plausible = takes(&encoder, &mut state, raw);
                prop_assert!(!plausible || (state.count().0 - before.0).abs() <= 100);
            }
        }
    }
}

#[test]
fn the_first_reading_is_the_origin() {
    let encoder = Encoder::new(16, false, 10);
    let mut state = EncoderState::default();
    assert!(takes(&encoder, &mut state, 0xFFFF));
    assert_eq!(state.count(), EncoderCount(0));
    assert!(takes(&encoder, &mut state, 0x0001));
    assert_eq!(state.count(), EncoderCount(2));
}

#[test]
fn half_a_turn_of_the_counter_is_implausible() {
    for (bits, half) in [(8, 0x80), (16, 0x8000), (32, 0x8000_0000)] {
        for reversed in [false, true] {
            let encoder = Encoder::new(bits, reversed, 100);
            let mut state = EncoderState::default();
            takes(&encoder, &mut state, 0);
            assert!(!takes(&encoder, &mut state, half));
        }
    }
}
