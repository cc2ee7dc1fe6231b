//! Meaning of the levels of limits, homes, amplifier faults and emergency stop at two ports of 16 pins.

use quadrant_law::safety::{AxisSwitches, Switches};

/// Bits of an axis in the word of `Switches`.
const BITS_PER_AXIS: u32 = 5;

/// Pins of the inputs: the first port has emergency stop (pin 0), the amplifiers' ready line (pin 1) and their faults, the second one
/// limits and homes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SwitchInputs {
    /// First port: pin of the first of three amplifier faults, x, y, z.
    pub first_fault: u32,
    /// Second port: pin of the first of six limits, x- x+ y- y+ z- z+.
    pub first_limit: u32,
    /// Second port: pin of the first of three home switches.
    pub first_home: u32,
}

impl SwitchInputs {
    /// The pins of the first and of the second port that are inputs of this kind; all have pull-ups.
    pub const fn pins(self) -> (u16, u16) {
        (
            0b11 | 0b111 << self.first_fault,
            0b11_1111 << self.first_limit | 0b111 << self.first_home,
        )
    }

    /// The switches from the levels of both ports.
    ///
    /// Every contact is closed, and every output conducts, while all is well: a low level. A pressed switch, an amplifier at
    /// fault, a broken wire and a lost supply are all high. An amplifier that is not ready is one at fault, and as the line
    /// is common, all three are.
    #[inline(always)]
    pub const fn switches(self, first: u16, second: u16) -> Switches {
        Switches::from_bits(
            self.of_axis(first, second, 0)
                | self.of_axis(first, second, 1) << BITS_PER_AXIS
                | self.of_axis(first, second, 2) << (2 * BITS_PER_AXIS)
                | (first & 1) << 15,
        )
    }

    /// Limits, home and fault of one axis, in the lowest four bits.
    #[inline(always)]
    const fn of_axis(self, first: u16, second: u16, axis: u32) -> u16 {
        let limits = second >> (self.first_limit + 2 * axis) & 0b11;
        let home = second >> (self.first_home + axis) & 1;
        let fault = (first >> (self.first_fault + axis) | first >> 1) & 1;
        limits | home << 2 | fault << 3
    }
}

/// The reading of a sagging supply of the processor: the same as amplifiers that are not ready, as nothing that this
/// processor says should drive them any more.
pub const SUPPLY_LOW: Switches = Switches::of_axes([AxisSwitches::AMPLIFIER_FAULT; 3]);
