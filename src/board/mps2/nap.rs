//! Waiting for a host in lockstep without keeping a processor of its computer busy.

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};

use super::timer::CLOCK_HZ;

/// Turns of the idle loop before the first nap, some 50 us: a host that exchanges tick by tick answers sooner.
const TURNS: u32 = 1 << 12;
/// Cycles of a nap: 200 us.
const CYCLES: u32 = CLOCK_HZ / 5_000;

/// The wait for the host's next word.
pub(super) struct Nap {
    timer: SYST,
    turns: u32,
}

impl Nap {
    /// A wait that has not begun.
    pub(super) fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(CYCLES);
        Self { timer, turns: 0 }
    }

    /// One turn of the idle loop without a word; after the first [`TURNS`] it sleeps.
    #[inline(always)]
    pub(super) fn turn(&mut self) {
        self.turns += 1;
        if self.turns >= TURNS {
            self.turns = TURNS;
            self.sleep();
        }
    }

    /// Ends the wait.
    #[inline(always)]
    pub(super) fn end(&mut self) {
        self.turns = 0;
    }

    /// Sleeps until the timer is due, or another interrupt is. The timer has no handler: its exception is pending only
    /// while it is masked.
    #[cold]
    #[inline(never)]
    fn sleep(&mut self) {
        cortex_m::interrupt::free(|_| {
            self.timer.clear_current();
            self.timer.enable_interrupt();
            self.timer.enable_counter();
            cortex_m::asm::wfi();
            self.timer.disable_counter();
            self.timer.disable_interrupt();
            SCB::clear_pendst();
        });
    }
}
