//! The log's rate limiter.

use proptest::prelude::*;
use quadrant::app::rate_limiter::RateLimiter;

const WINDOW: u32 = 100;
const LINES: u16 = 3;

#[test]
fn so_many_lines_pass_and_then_it_says_how_many_more_there_were() {
    let mut limiter = RateLimiter::<2>::new(WINDOW, LINES);
    let passed = (0..10).filter(|tick| limiter.admits(0, *tick)).count();
    assert_eq!(passed, 3);
    assert!(limiter.admits(1, 10), "the other kind is not affected");
    assert_eq!(limiter.overdue(99), None, "the while is not over");
    assert_eq!(limiter.overdue(100), Some((0, 7)));
    assert_eq!(limiter.overdue(100), None, "it is said once");
    assert!(limiter.admits(0, 100), "a new while begins");
}

#[test]
fn a_kind_that_was_not_announced_passes() {
    let mut limiter = RateLimiter::<1>::new(WINDOW, 0);
    assert!(limiter.admits(1, 0));
    assert!(!limiter.admits(0, 0));
}

#[test]
fn the_tick_may_wrap() {
    let mut limiter = RateLimiter::<1>::new(WINDOW, 1);
    let end = u32::MAX;
    assert!(limiter.admits(0, end));
    assert!(!limiter.admits(0, end.wrapping_add(99)));
    assert_eq!(limiter.overdue(end.wrapping_add(100)), Some((0, 1)));
}

proptest! {
    /// However lines come, no span of a window's length sees more than two windows' lines, and every line is either
    /// printed or counted.
    #[test]
    fn a_flood_is_thinned_and_nothing_is_lost_uncounted(
        steps in prop::collection::vec((0_u32..40, 0_usize..2), 1..400),
    ) {
        let mut limiter = RateLimiter::<2>::new(WINDOW, LINES);
        let (mut tick, mut counted, mut asked) = (0, 0, 0);
        let mut printed: [Vec<u32>; 2] = [Vec::new(), Vec::new()];
        for (step, kind) in steps {
            tick += step;
            while let Some((_, left_out)) = limiter.overdue(tick) {
                counted += left_out as usize;
            }
            asked += 1;
            if limiter.admits(kind, tick) {
                printed[kind].push(tick);
            }
        }
        while let Some((_, left_out)) = limiter.overdue(tick + WINDOW) {
            counted += left_out as usize;
        }
        prop_assert_eq!(printed.iter().map(Vec::len).sum::<usize>() + counted, asked);
        for ticks in &printed {
            for span in ticks.windows(2 * usize::from(LINES) + 1) {
                prop_assert!(span[span.len() - 1] - span[0] >= WINDOW);
            }
        }
    }
}
