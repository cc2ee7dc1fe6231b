//! Switches, amplifier faults and the emergency stop: fourteen pins, two reads of a port. And the supply.

use quadrant::drivers::switch_inputs::SUPPLY_LOW;
use quadrant::hal;
use quadrant_law::safety;

use crate::board::chip::{INPUTS, Supply, levels};

/// The digital inputs of the stage.
pub(crate) struct Switches {
    supply: Supply,
}

impl Switches {
    /// The inputs, which have pull-ups.
    pub(crate) const fn new(supply: Supply) -> Self {
        Self { supply }
    }
}

impl hal::Switches for Switches {
    #[inline(always)]
    fn read(&mut self) -> safety::Switches {
        let (first, second) = levels();
        let pins = INPUTS.switches(first, second);
        if self.supply.is_low() {
            pins.with(SUPPLY_LOW)
        } else {
            pins
        }
    }
}

/// GPIOx_PUPDR with pull-ups (01) on these pins (RM0390, 7.4.4; RM0433, 11.4.4).
pub(crate) const fn pull_ups(pins: u16) -> u32 {
    let mut bits = 0;
    let mut pin = 0;
    while pin < 16 {
        bits |= ((pins >> pin & 1) as u32) << (2 * pin);
        pin += 1;
    }
    bits
}
