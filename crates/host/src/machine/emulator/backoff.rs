//! Waiting for a firmware that answers within microseconds, if it has a processor.

use std::time::Duration;

/// Looks before the first pause: an answer takes some 10 us, a look less than 1.
const LOOKS: u32 = 100;
/// Pauses that only yield the processor, before those that sleep.
const YIELDS: u32 = 200;
/// A pause that sleeps.
const SLEEP: Duration = Duration::from_micros(50);

/// The pauses of a wait: none at first, then longer and longer ones, as the firmware may need this very core.
#[derive(Clone, Copy, Debug, Default)]
pub struct Backoff {
    looks: u32,
}

impl Backoff {
    /// Pauses before the next look.
    pub fn pause(&mut self) {
        self.looks = self.looks.saturating_add(1);
        if self.looks < LOOKS {
            std::hint::spin_loop();
        } else if self.looks < LOOKS + YIELDS {
            std::thread::yield_now();
        } else {
            std::thread::sleep(SLEEP);
        }
    }
}
