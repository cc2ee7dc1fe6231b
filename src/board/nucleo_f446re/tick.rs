//! The control tick: basic timer 7, which counts up and interrupts when it starts over.

use stm32f4xx_hal::pac::TIM7;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

/// The control tick.
pub(crate) struct Tick {
    timer: TIM7,
    period: u32,
}

impl Tick {
    /// Starts the timer with `rate_hz` ticks per second.
    pub(super) fn start(timer: TIM7, rate_hz: u32, rcc: &mut Rcc) -> Self {
        let period = rcc.clocks.timclk1().raw() / rate_hz;
        let Ok(reload) = u16::try_from(period - 1) else {
            panic!("{rate_hz} Hz is too slow for a 16-bit timer without a prescaler");
        };
        TIM7::enable(rcc);
        TIM7::reset(rcc);
        timer.arr().write(|w| w.arr().set(reload));
        timer.dier().write(|w| w.uie().enabled());
        timer.cr1().write(|w| w.cen().enabled());
        Self { timer, period }
    }

    /// Begins a tick: clears its interrupt.
    #[inline(always)]
    pub(crate) fn acknowledge(&mut self) {
        self.timer.sr().write(|w| w.uif().clear());
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
