//! Liveness of control, supervision and server: the condition for feeding the watchdog.

/// Longest time without a poll of the server, in runs of the supervising task (ms): it builds settings, and erases flash.
const SERVER_TIMEOUT_RUNS: u32 = 10_000;

/// Watches control, supervision and the server. Supervision is watched by running this.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Liveness {
    tick: u32,
    polls: u32,
    silent: u32,
}

impl Liveness {
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
        control && self.silent < SERVER_TIMEOUT_RUNS
    }

    /// Returns the server's silence, ms, when it reaches half the timeout.
    pub const fn warning_ms(&self) -> Option<u32> {
        if self.silent == SERVER_TIMEOUT_RUNS / 2 {
            Some(self.silent)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_of_all_feeds_the_watchdog() {
        let mut liveness = Liveness::default();
        assert!((1..100).all(|run| liveness.check(10 * run, run)));
    }

    #[test]
    fn control_that_stands_starves_it_at_once() {
        let mut liveness = Liveness::default();
        assert!(liveness.check(10, 1));
        assert!(!liveness.check(10, 2));
    }

    #[test]
    fn a_server_that_stands_starves_it_after_its_timeout() {
        let mut liveness = Liveness::default();
        assert!(liveness.check(10, 1));
        let fed = (1..20_000)
            .take_while(|run| liveness.check(10 + 10 * run, 1))
            .count();
        assert_eq!(fed as u32, SERVER_TIMEOUT_RUNS - 1);
    }

    #[test]
    fn half_of_the_timeout_is_worth_one_warning() {
        let mut liveness = Liveness::default();
        let warned = (0..20_000)
            .filter(|run| {
                liveness.check(10 + 10 * run, 1);
                liveness.warning_ms().is_some()
            })
            .count();
        assert_eq!(warned, 1);
    }
}
