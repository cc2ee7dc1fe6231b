//! The control tick: basic timer 7, which counts up and interrupts when it starts over.

use cortex_m::peripheral::{DCB, DWT};
use quadrant::drivers::tick_interval::TickInterval;

use crate::board::chip::pac::TIM7;

/// The control tick.
pub(crate) struct Tick {
    timer: TIM7,
    clock_hz: u32,
    period: u32,
    core_hz: u32,
    interval: TickInterval,
}

impl Tick {
    /// The timer, clocked, reset and not counting, and its rate and the core's, Hz; starts the core's counter of cycles.
    pub(crate) fn new(
        timer: TIM7,
        (clock_hz, core_hz): (u32, u32),
        mut trace: DCB,
        mut counter: DWT,
    ) -> Self {
        trace.enable_trace();
        counter.enable_cycle_counter();
        Self {
            timer,
            clock_hz,
            period: u32::MAX,
            core_hz,
            interval: TickInterval::new(u32::MAX, 0),
        }
    }

    /// Starts `rate_hz` ticks per second.
    pub(crate) fn start(&mut self, rate_hz: u32) {
        self.period = self.clock_hz / rate_hz;
        let Ok(reload) = u16::try_from(self.period - 1) else {
            panic!("{rate_hz} Hz is too slow for a 16-bit timer without a prescaler");
        };
        self.timer.arr().write(|w| w.arr().set(reload));
        self.interval = TickInterval::new(self.core_hz / rate_hz, DWT::cycle_count());
        self.timer.dier().write(|w| w.uie().enabled());
        self.timer.cr1().write(|w| w.cen().enabled());
    }

    /// Rate of the timer, Hz.
    pub(crate) fn cycle_hz(&self) -> u32 {
        self.clock_hz
    }

    /// Begins a tick: clears its interrupt. Returns true if it begins late.
    #[inline(always)]
    pub(crate) fn begin(&mut self) -> bool {
        self.timer.sr().write(|w| w.uif().clear());
        // The timer itself does not know how often it has started over.
        self.interval.is_late(DWT::cycle_count())
    }

    /// Cycles of the timer between two ticks.
    #[inline(always)]
    pub(crate) fn period_cycles(&self) -> u32 {
        self.period
    }

    /// Cycles of the timer since this tick was due; [`Tick::period_cycles`] when the next one is due already.
    #[inline(always)]
    pub(crate) fn elapsed_cycles(&self) -> u32 {
        let count = self.timer.cnt().read().cnt().bits();
        // Asked after the counter was read: a reload in between is seen.
        if self.timer.sr().read().uif().bit_is_set() {
            self.period
        } else {
            count.into()
        }
    }
}
