//! Counters, input filters and DMA rings.

use proptest::prelude::*;
use quadrant::drivers::counter::ExtendedCounter;
use quadrant::drivers::dma_ring::DmaRing;
use quadrant::drivers::input_filter::{InputFilter, shortest_level_ns};

proptest! {
    /// A 16-bit counter read often enough is the low half of a 32-bit one.
    #[test]
    fn a_narrow_counter_is_extended(steps in prop::collection::vec(-32_767_i32..=32_767, 1..200)) {
        let mut counter = ExtendedCounter::default();
        let mut true_count = 0_u32;
        for step in steps {
            true_count = true_count.wrapping_add_signed(step);
            prop_assert_eq!(counter.read(true_count as u16), true_count);
        }
    }

    /// An index captured anywhere near is placed right, on either side of a wrap.
    #[test]
    fn a_captured_count_is_placed(steps in prop::collection::vec(-30_000_i32..=30_000, 1..50), away in -32_767_i32..=32_767) {
        let mut counter = ExtendedCounter::default();
        let mut true_count = 0_u32;
        for step in steps {
            true_count = true_count.wrapping_add_signed(step);
            counter.read(true_count as u16);
        }
        let index = true_count.wrapping_add_signed(away);
        prop_assert_eq!(counter.captured(index as u16), index);
    }

    /// Every byte arrives once and in order, as long as less than a ring is written between two reads.
    #[test]
    fn a_ring_that_is_read_in_time_loses_nothing(
        bursts in prop::collection::vec((0_usize..16, 0_usize..40), 1..100),
    ) {
        const N: usize = 16;
        let mut ring = [0_u8; N];
        let mut reader = DmaRing::<N>::new();
        let (mut written, mut expected, mut unread) = (0_usize, 0_u8, 0_usize);
        for (burst, room) in bursts {
            // The stream writes as much as leaves one byte free.
            for _ in 0..burst.min(N - 1 - unread) {
                ring[written % N] = written as u8;
                written += 1;
                unread += 1;
            }
            let mut into = vec![0xAA; room];
            let got = reader.read(N - written % N, |at| ring[at], &mut into);
            prop_assert_eq!(got, room.min(unread));
            unread -= got;
            for byte in &into[..got] {
                prop_assert_eq!(*byte, expected);
                expected = expected.wrapping_add(1);
            }
        }
    }

    /// With any content of the stream's register, nothing outside the ring is read and the call ends.
    #[test]
    fn a_ring_survives_a_broken_register(remainders in prop::collection::vec(any::<usize>(), 1..50)) {
        let mut reader = DmaRing::<16>::new();
        for remaining in remainders {
            let mut into = [0; 64];
            let got = reader.read(remaining, |at| { assert!(at < 16); 0 }, &mut into);
            prop_assert!(got < 16);
        }
    }
}

#[test]
fn the_filter_is_the_strongest_that_lets_the_fastest_axis_pass() {
    // 250 mm/s at 0.5 um per count, and twice that before an encoder counts as faulty: 1 million counts a second.
    let level_ns = shortest_level_ns(1_000_000);
    assert_eq!(level_ns, 1_000);
    // Timers 2 and 3 run at 90 MHz, timer 8 at 180 MHz with its filter clock halved: the same filter.
    let slow = InputFilter::strongest(90_000_000, 1, level_ns);
    let fast = InputFilter::strongest(180_000_000, 2, level_ns);
    assert_eq!(
        slow,
        InputFilter {
            icf: 9,
            rejects_ns: 712
        }
    );
    assert_eq!(fast, slow);
}

#[test]
fn a_filter_never_swallows_a_level_that_must_pass() {
    for timer_hz in [16_000_000, 45_000_000, 90_000_000, 180_000_000] {
        for ckd in [1, 2, 4] {
            for level_ns in (0..20_000).step_by(37) {
                let filter = InputFilter::strongest(timer_hz, ckd, level_ns);
                assert!(filter.icf < 16);
                assert!(filter.rejects_ns <= level_ns);
            }
        }
    }
    assert_eq!(
        InputFilter::strongest(90_000_000, 1, 5).icf,
        0,
        "nothing fits: no filter"
    );
}
