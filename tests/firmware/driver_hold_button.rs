//! The dead man's switch.

use proptest::prelude::*;
use quadrant::drivers::hold_button::{DEBOUNCE_TICKS, HoldButton};
use quadrant_law::command::Command;

const LONG: usize = DEBOUNCE_TICKS as usize;

/// The requests, and their ticks.
fn asked(levels: &[bool]) -> Vec<(usize, Command)> {
    let mut button = HoldButton::new();
    let step = |(tick, &is_down)| button.step(is_down).map(|command| (tick, command));
    levels.iter().enumerate().filter_map(step).collect()
}

fn levels(runs: &[(bool, usize)]) -> Vec<bool> {
    runs.iter()
        .flat_map(|&(is_down, ticks)| std::iter::repeat_n(is_down, ticks))
        .collect()
}

#[test]
fn held_long_enough_it_enables_and_let_go_it_disables_at_once() {
    let pressed = levels(&[(false, LONG), (true, LONG + 5), (false, 3)]);
    assert_eq!(
        asked(&pressed),
        [
            (2 * LONG - 1, Command::Enable),
            (2 * LONG + 5, Command::Disable)
        ]
    );
}

#[test]
fn down_since_the_start_it_asks_for_nothing_until_it_was_up() {
    assert_eq!(asked(&levels(&[(true, 1_000)])), []);
    let released = levels(&[(true, 1_000), (false, LONG), (true, LONG)]);
    assert_eq!(asked(&released), [(999 + 2 * LONG, Command::Enable)]);
}

#[test]
fn a_press_that_is_too_short_is_none() {
    assert_eq!(
        asked(&levels(&[(false, LONG), (true, LONG - 1), (false, LONG)])),
        []
    );
}

proptest! {
    /// With any sequence of the contacts: enabled and disabled alternate, and enabling takes the whole time up and down before.
    #[test]
    fn bouncing_never_enables_twice(bounces in prop::collection::vec(any::<(bool, u8)>(), 0..60)) {
        let runs: Vec<_> = bounces.iter().map(|&(down, ticks)| (down, usize::from(ticks))).collect();
        let levels = levels(&runs);
        let mut last = Command::Disable;
        for (tick, command) in asked(&levels) {
            prop_assert_ne!(command, last);
            if command == Command::Enable {
                prop_assert!(levels[tick + 1 - LONG..=tick].iter().all(|down| *down));
                prop_assert!(levels[..tick].windows(LONG).any(|up| up.iter().all(|down| !down)));
            } else {
                prop_assert!(!levels[tick]);
            }
            last = command;
        }
    }
}
