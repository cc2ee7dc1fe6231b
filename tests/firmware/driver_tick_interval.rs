//! Control ticks that begin late.

use quadrant::drivers::tick_interval::TickInterval;

#[test]
fn a_tick_may_begin_a_quarter_of_its_period_late_and_no_later() {
    // Across the counter's end, too.
    for start in [0, 12_345, u32::MAX - 150] {
        for (since, late) in [
            (0, false),
            (100, false),
            (125, false),
            (126, true),
            (200, true),
        ] {
            let mut interval = TickInterval::new(100, start);
            assert_eq!(interval.is_late(start.wrapping_add(since)), late, "{since}");
        }
    }
}

#[test]
fn the_tick_after_a_late_one_is_measured_from_that_one() {
    let mut interval = TickInterval::new(100, 0);
    assert!(!interval.is_late(100));
    assert!(interval.is_late(290));
    // In its own time again, hence early.
    assert!(!interval.is_late(300));
    assert!(!interval.is_late(400));
    // Two ticks are lost.
    assert!(interval.is_late(700));
}

#[test]
fn a_period_beyond_the_counter_is_never_late() {
    let mut interval = TickInterval::new(u32::MAX, 0);
    assert!(!interval.is_late(u32::MAX));
}
