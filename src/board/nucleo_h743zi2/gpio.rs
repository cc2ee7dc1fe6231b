//! Pins by port and number. After reset all but those of the debug port are analogue and float (RM0433, 11.4.1).

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, OutputPin};
use stm32h7::stm32h743v::gpioc::RegisterBlock;

/// Bases of the ports' registers (RM0433, table 8).
pub(crate) const B: usize = 0x5802_0400;
pub(crate) const A: usize = 0x5802_0000;
pub(crate) const C: usize = 0x5802_0800;
pub(crate) const D: usize = 0x5802_0C00;
pub(crate) const E: usize = 0x5802_1000;
pub(crate) const F: usize = 0x5802_1400;
pub(crate) const G: usize = 0x5802_1800;

/// GPIOx_MODER, two bits a pin (RM0433, 11.4.1).
const INPUT: u32 = 0b00;
const OUTPUT: u32 = 0b01;
const ALTERNATE: u32 = 0b10;

/// GPIOx_PUPDR, two bits a pin (RM0433, 11.4.4).
#[derive(Clone, Copy)]
#[repr(u32)]
pub(crate) enum Pull {
    None = 0b00,
    Up = 0b01,
    Down = 0b10,
}

/// A pin that somebody owns.
pub(crate) struct Pin<const PORT: usize, const NUMBER: u8>(());

/// The registers of a port.
#[inline(always)]
pub(crate) fn port(base: usize) -> &'static RegisterBlock {
    // SAFETY: one of the bases above; all ports have the same registers. They are shared: what touches the same register in two
    // contexts is a single write to BSRR or a read of IDR.
    unsafe { &*(base as *const RegisterBlock) }
}

impl<const PORT: usize, const NUMBER: u8> Pin<PORT, NUMBER> {
    /// The pin; the caller is the only one that takes it, before any interrupt.
    const fn take() -> Self {
        Self(())
    }

    fn configure(mode: u32, pull: Pull) {
        let shift = 2 * NUMBER;
        // SAFETY: two bits of this pin.
        unsafe {
            port(PORT)
                .pupdr()
                .modify(|r, w| w.bits(r.bits() & !(0b11 << shift) | (pull as u32) << shift));
            port(PORT)
                .moder()
                .modify(|r, w| w.bits(r.bits() & !(0b11 << shift) | mode << shift));
        }
    }

    /// An output, push-pull (OTYPER after reset), with its level from the first moment.
    pub(crate) fn output(is_high: bool) -> Self {
        let mut pin = Self::take();
        if is_high {
            pin.set_high();
        } else {
            pin.set_low();
        }
        Self::configure(OUTPUT, Pull::None);
        pin
    }

    /// The same with the fastest edges (OSPEEDR = 11; RM0433, 11.4.3).
    pub(crate) fn fast_output(is_high: bool) -> Self {
        Self::hurry();
        Self::output(is_high)
    }

    /// An input.
    pub(crate) fn input(pull: Pull) -> Self {
        Self::configure(INPUT, pull);
        Self::take()
    }

    /// The pin of a peripheral, by the number of the alternate function (AFRL, AFRH; RM0433, 11.4.9 and 11.4.10).
    pub(crate) fn alternate(function: u32, pull: Pull) {
        let shift = 4 * (NUMBER % 8);
        let set = |bits: u32| bits & !(0b1111 << shift) | function << shift;
        // SAFETY: four bits of this pin.
        unsafe {
            if NUMBER < 8 {
                port(PORT).afrl().modify(|r, w| w.bits(set(r.bits())));
            } else {
                port(PORT).afrh().modify(|r, w| w.bits(set(r.bits())));
            }
        }
        Self::configure(ALTERNATE, pull);
    }

    /// The same with the fastest edges.
    pub(crate) fn fast_alternate(function: u32) {
        Self::hurry();
        Self::alternate(function, Pull::None);
    }

    fn hurry() {
        // SAFETY: two bits of this pin.
        unsafe {
            port(PORT)
                .ospeedr()
                .modify(|r, w| w.bits(r.bits() | 0b11 << (2 * NUMBER)));
        }
    }

    /// Drives an output high.
    #[inline(always)]
    pub(crate) fn set_high(&mut self) {
        // SAFETY: the bit that sets this pin (RM0433, 11.4.7).
        unsafe { port(PORT).bsrr().write(|w| w.bits(1 << NUMBER)) };
    }

    /// Drives an output low.
    #[inline(always)]
    pub(crate) fn set_low(&mut self) {
        // SAFETY: the bit that resets this pin.
        unsafe { port(PORT).bsrr().write(|w| w.bits(1 << (16 + NUMBER))) };
    }

    /// True if the pin is high.
    #[inline(always)]
    pub(crate) fn is_high(&self) -> bool {
        port(PORT).idr().read().bits() & 1 << NUMBER != 0
    }

    /// True if the pin is low.
    #[inline(always)]
    pub(crate) fn is_low(&self) -> bool {
        !self.is_high()
    }
}

impl<const PORT: usize, const NUMBER: u8> ErrorType for Pin<PORT, NUMBER> {
    type Error = Infallible;
}

impl<const PORT: usize, const NUMBER: u8> OutputPin for Pin<PORT, NUMBER> {
    #[inline(always)]
    fn set_low(&mut self) -> Result<(), Infallible> {
        Self::set_low(self);
        Ok(())
    }

    #[inline(always)]
    fn set_high(&mut self) -> Result<(), Infallible> {
        Self::set_high(self);
        Ok(())
    }
}
