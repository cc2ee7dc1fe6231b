//! Liveness of control, supervision and server: the condition for feeding the watchdog.

use quadrant_law::supervisor::PERIOD_TICKS;

/// Longest time without a poll of the server, s: it builds settings, and erases flash.
const SERVER_TIMEOUT_S: u32 = 10;

/// Watches control, supervision and the server. Supervision is watched by running this.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Liveness {
    /// The server's timeout, in runs of the supervising task.
    timeout_runs: u32,
    tick: u32,
    polls: u32,
    silent: u32,
}

impl Liveness {
    /// Returns the watch at a control rate.
    pub const fn new(rate_hz: u32) -> Self {
        Self {
            timeout_runs: SERVER_TIMEOUT_S * rate_hz / PERIOD_TICKS,
            tick: 0,
            polls: 0,
            silent: 0,
        }
    }

    /// Takes the control tick and how often the server has been polled; returns true if the watchdog is to be fed. Once a run of
    /// the supervising task.
    pub fn check(&mut self, tick: u32, polls: u32) -> bool {
        let control = tick != self.tick;
        self.silent = if polls == self.polls {
            self.silent.saturating_add(1)
        } else {
            0
        };
        (self.tick, self.polls) = (tick, polls);
        control && self.silent < self.timeout_runs
    }

    /// Returns the server's silence, ms, when it reaches half the timeout.
    pub const fn warning_ms(&self) -> Option<u32> {
        if self.silent == self.timeout_runs / 2 {
            Some(SERVER_TIMEOUT_S * 1000 / 2)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: u32 = 10_000;

    #[test]
    fn progress_of_all_feeds_the_watchdog() {
        let mut liveness = Liveness::new(RATE_HZ);
        assert!((1..100).all(|run| liveness.check(10 * run, run)));
    }

    #[test]
    fn control_that_stands_starves_it_at_once() {
        let mut liveness = Liveness::new(RATE_HZ);
        assert!(liveness.check(10, 1));
        assert!(!liveness.check(10, 2));
    }

    #[test]
    fn a_server_that_stands_starves_it_after_its_timeout_at_every_control_rate() {
        for rate_hz in [2_500, 10_000, 15_000] {
            let mut liveness = Liveness::new(rate_hz);
            assert!(liveness.check(10, 1));
            let fed = (1..20_000)
                .take_while(|run| liveness.check(10 + 10 * run, 1))
                .count();
            assert_eq!((fed as u32 + 1) * PERIOD_TICKS, 10 * rate_hz);
        }
    }

    #[test]
    fn half_of_the_timeout_is_worth_one_warning() {
        let mut liveness = Liveness::new(RATE_HZ);
        let mut warnings = (0..20_000).filter_map(|run| {
            liveness.check(10 + 10 * run, 1);
            liveness.warning_ms()
        });
        assert_eq!((warnings.next(), warnings.next()), (Some(5_000), None));
    }
}
