//! Switches, amplifier faults and the emergency stop: fourteen pins, two reads of a port. And the supply.

use quadrant::hal;
use quadrant_law::safety;
use stm32f4xx_hal::pac::{GPIOA, GPIOC};

use super::watchdog::Supply;
use super::wiring::{self, PORT_A_INPUTS, PORT_C_INPUTS, SUPPLY_LOW};

/// The digital inputs of the stage.
pub(crate) struct Switches {
    supply: Supply,
}

impl Switches {
    /// Gives every input a pull-up; inputs they are after reset.
    ///
    /// The ports were split, which has clocked and reset them. The pins are taken by number, as fourteen types would say
    /// less than two masks.
    pub(super) fn new(supply: Supply) -> Self {
        // SAFETY: two bits a pin, 01 for a pull-up (RM0390, 7.4.4); the pins of the masks are nobody else's, and this
        // runs before any interrupt that touches the ports.
        unsafe {
            (*GPIOA::ptr())
                .pupdr()
                .modify(|r, w| w.bits(r.bits() | pull_ups(PORT_A_INPUTS)));
            (*GPIOC::ptr())
                .pupdr()
                .modify(|r, w| w.bits(r.bits() | pull_ups(PORT_C_INPUTS)));
        }
        Self { supply }
    }
}

impl hal::Switches for Switches {
    #[inline(always)]
    fn read(&mut self) -> safety::Switches {
        // SAFETY: reading a port's levels changes nothing and needs no owner.
        let (port_a, port_c) = unsafe { (&*GPIOA::ptr(), &*GPIOC::ptr()) };
        let pins = wiring::switches(
            port_a.idr().read().bits() as u16,
            port_c.idr().read().bits() as u16,
        );
        if self.supply.is_low() {
            pins.with(SUPPLY_LOW)
        } else {
            pins
        }
    }
}

/// GPIOx_PUPDR with pull-ups on these pins.
const fn pull_ups(pins: u16) -> u32 {
    let mut bits = 0;
    let mut pin = 0;
    while pin < 16 {
        bits |= ((pins >> pin & 1) as u32) << (2 * pin);
        pin += 1;
    }
    bits
}
