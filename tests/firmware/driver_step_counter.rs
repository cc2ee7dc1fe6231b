//! Steps with a sense, from a counter that only counts upwards.

use quadrant::drivers::step_counter::{StepCounter, StepReading};

fn seen(direction: bool, raw: u16, turned: Option<u16>) -> StepReading {
    StepReading {
        direction,
        raw,
        turned,
        overrun: false,
    }
}

#[test]
fn steps_before_and_after_an_edge_count_in_their_own_sense() {
    let mut counter = StepCounter::new(65_530, false);
    assert_eq!(counter.read(seen(false, 65_535, None)), (5, false));
    // Three more forth, over the counter's end, and seven back.
    assert_eq!(counter.read(seen(true, 6, Some(2))), (8 - 4, false));
    assert_eq!(
        counter.read(seen(true, 16, None)),
        (4_u32.wrapping_sub(10), false)
    );
    assert_eq!(
        counter.read(seen(false, 20, Some(16))),
        (4_u32.wrapping_sub(6), false)
    );
}

#[test]
fn an_edge_between_two_registers_costs_no_step() {
    let mut counter = StepCounter::new(0, false);
    // The count is read as 10; then a step forth, an edge, and the capture is read.
    counter.read(seen(false, 10, Some(11)));
    // Four back.
    assert_eq!(counter.read(seen(true, 15, None)), (11 - 4, false));
    // The level is read before the edge, and the capture after it.
    assert_eq!(counter.read(seen(true, 15, Some(15))), (7, false));
    assert_eq!(counter.read(seen(false, 17, None)), (9, false));
}

#[test]
fn two_edges_or_a_level_without_an_edge_are_lost_steps() {
    let mut counter = StepCounter::new(0, false);
    let twice = StepReading {
        overrun: true,
        ..seen(false, 9, Some(5))
    };
    assert!(counter.read(twice).1);
    let mut counter = StepCounter::new(0, false);
    // Its capture may be behind the filter still; at the next reading it is not.
    assert_eq!(counter.read(seen(true, 9, None)), (9, false));
    assert!(counter.read(seen(true, 12, None)).1);
    assert!(!counter.read(seen(true, 15, None)).1);
}

/// The level comes at once, count and capture 0.7 us later: an edge at any time between two readings of 100 us.
#[test]
fn an_edge_shortly_before_a_reading_loses_no_step_though_its_capture_is_filtered() {
    const READING_NS: u32 = 100_000;
    const FILTER_NS: u32 = 710;
    const STEP_NS: u32 = 2_000;
    for edge_ns in (200_000..300_000).step_by(10) {
        let steps = |at_ns: u32| (at_ns.saturating_sub(FILTER_NS) / STEP_NS) as u16;
        let mut counter = StepCounter::new(0, false);
        let mut turned = Some(steps(edge_ns + FILTER_NS));
        for reading in 1..=6 {
            let now_ns = reading * READING_NS;
            let captured = (edge_ns + FILTER_NS < now_ns)
                .then(|| turned.take())
                .flatten();
            let (_, lost) = counter.read(seen(edge_ns < now_ns, steps(now_ns), captured));
            assert!(!lost, "edge at {edge_ns} ns, reading {reading}");
        }
        let (forth, all) = (
            i32::from(steps(edge_ns + FILTER_NS)),
            i32::from(steps(6 * READING_NS)),
        );
        let last = seen(true, steps(6 * READING_NS), None);
        assert_eq!(
            counter.read(last),
            ((2 * forth - all) as u32, false),
            "edge at {edge_ns} ns"
        );
    }
}

#[test]
fn any_train_that_turns_at_most_once_a_reading_is_summed_exactly() {
    let mut noise = 1_u32;
    let mut random = move |most: u32| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (noise >> 8) % most
    };
    let (mut counter, mut raw, mut exact, mut backwards) =
        (StepCounter::new(0, false), 0_u16, 0_i64, false);
    for _ in 0..100_000 {
        let mut turned = None;
        for _ in 0..random(60) {
            if turned.is_none() && random(40) == 0 {
                turned = Some(raw);
                backwards = !backwards;
            }
            raw = raw.wrapping_add(1);
            exact += if backwards { -1 } else { 1 };
        }
        assert_eq!(
            counter.read(seen(backwards, raw, turned)),
            (exact as u32, false)
        );
    }
}
