//! Step and direction of another control, for one axis, and its lines SERVO ON and ALARM.
//!
//! A timer counts the rising edges of the step line (RM0390, 17.3.3 "External clock source mode 1"; RM0433, 38.3.5: its
//! clock is the filtered input of channel 1) and captures the count at both edges of the direction line on channel 2, so that each
//! step has its sense however late the tick reads it ([`StepCounter`]). Encoder mode would count both edges of a step, one forth and
//! one back (17.3.12, table of "Counting direction versus encoder signals").

use quadrant::drivers::step_counter::{StepCounter, StepReading};
use quadrant::hal::{self, PulseReadings};

use crate::board::chip::{Alarm, ENCODER_FILTER, FILTER_CLOCK, ServoOn, StepTimer, is_backwards};

/// TIMx_CCMR1: channels 1 and 2 are inputs from their own pins (CC1S = CC2S = 01), filtered (IC1F, IC2F) equally: both lines are late by
/// the same time.
const STEP_AND_DIRECTION: u32 = (0b01 | (ENCODER_FILTER.icf as u32) << 4) * 0x0101;
/// TIMx_CCER: capture on channel 2 enabled (CC2E), at both edges (CC2P, CC2NP); the step is not inverted.
const CAPTURE_BOTH_EDGES: u32 = 1 << 4 | 1 << 5 | 1 << 7;
/// TIMx_SMCR: the clock is (SMS = 111) the filtered input of channel 1 (TS = 101).
const CLOCK_FROM_STEP: u32 = 0b111 | 0b101 << 4;
/// TIMx_CR1: counter enabled (CEN).
const ENABLE: u32 = 1;

/// The lines of a control that leads x.
pub(crate) struct StepInput {
    timer: StepTimer,
    counter: StepCounter,
    servo_on: ServoOn,
    alarm: Alarm,
}

impl StepInput {
    /// Starts counting from zero. The timer is clocked and reset, and its pins have their function.
    pub(crate) fn new(timer: StepTimer, servo_on: ServoOn, alarm: Alarm) -> Self {
        // SAFETY: the values are the manual's for these registers, as the constants say.
        unsafe {
            timer
                .ccmr1_input()
                .write(|w| w.bits(STEP_AND_DIRECTION as _));
            timer.ccer().write(|w| w.bits(CAPTURE_BOTH_EDGES as _));
            timer.smcr().write(|w| w.bits(CLOCK_FROM_STEP as _));
            timer.arr().write(|w| w.bits(u16::MAX.into()));
            timer.cr1().write(|w| w.bits((ENABLE | FILTER_CLOCK) as _));
            // No event on the inputs before this point was a turn.
            timer.sr().write(|w| w.bits(0));
        }
        let counter = StepCounter::new(timer.cnt().read().bits() as u16, is_backwards());
        Self {
            timer,
            counter,
            servo_on,
            alarm,
        }
    }
}

impl hal::Pulses for StepInput {
    /// The level is read first, then the count, then the capture: [`StepCounter::read`] allows for an edge in between.
    #[inline(always)]
    fn read(&mut self) -> PulseReadings {
        let direction = is_backwards();
        let raw = self.timer.cnt().read().bits() as u16;
        let status = self.timer.sr().read();
        // Reading CCR2 clears CC2IF.
        let turned = status
            .cc2if()
            .bit_is_set()
            .then(|| self.timer.ccr2().read().ccr().bits());
        let overrun = status.cc2of().bit_is_set();
        if overrun {
            // SAFETY: the flags are cleared by zeros; CC2IF is clear by now.
            self.timer.sr().write(|w| unsafe { w.bits(0) });
        }
        let (count, lost) = self.counter.read(StepReading {
            direction,
            raw,
            turned,
            overrun,
        });
        PulseReadings {
            counts: [count, 0, 0],
            lost: [lost, false, false],
            // The control closes it to ground.
            servo_on: self.servo_on.is_low(),
        }
    }

    /// High while all is well: an optocoupler that conducts.
    #[inline(always)]
    fn set_alarm(&mut self, alarm: bool) {
        if alarm {
            self.alarm.set_low();
        } else {
            self.alarm.set_high();
        }
    }
}
