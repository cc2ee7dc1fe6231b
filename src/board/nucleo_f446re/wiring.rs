//! Meaning of the bits in the board's words. No registers here: the tests of the library include this file and run it on the host.

use quadrant::drivers::input_filter::{InputFilter, shortest_level_ns};
use quadrant::hal::ResetCause;
use quadrant_law::safety::{AxisSwitches, Switches};

/// The fastest an encoder may count, per second: an axis at 250 mm/s with 0.5 um per count, and twice that, as the
/// control law believes an encoder up to twice the axis' largest velocity.
const FASTEST_COUNTS_PER_S: u32 = 1_000_000;

/// The filter of all nine encoder inputs, at 90 MHz: timer 8 runs at twice that and halves its filter clock.
pub(crate) const ENCODER_FILTER: InputFilter =
    InputFilter::strongest(90_000_000, 1, shortest_level_ns(FASTEST_COUNTS_PER_S));

/// Port A: the emergency stop.
const EMERGENCY_STOP: u16 = 1 << 0;
/// Port A: the amplifiers' ready line.
const NOT_READY: u16 = 1 << 1;
/// Port A: the first of three amplifier faults, x, y, z.
const FIRST_FAULT: u32 = 8;
/// Port C: the first of six limits, x- x+ y- y+ z- z+.
const FIRST_LIMIT: u32 = 0;
/// Port C: the first of three home switches.
const FIRST_HOME: u32 = 10;

/// The pins of port A and of port C that are inputs of this kind; all have pull-ups.
pub(crate) const PORT_A_INPUTS: u16 = EMERGENCY_STOP | NOT_READY | 0b111 << FIRST_FAULT;
pub(crate) const PORT_C_INPUTS: u16 = 0b11_1111 << FIRST_LIMIT | 0b111 << FIRST_HOME;

/// Bits of an axis in the word of `Switches`.
const BITS_PER_AXIS: u32 = 5;

/// The switches from the levels of both ports.
///
/// Every contact is closed, and every output conducts, while all is well: a low level. A pressed switch, an amplifier at
/// fault, a broken wire and a lost supply are all high. An amplifier that is not ready is one at fault, and as the line
/// is common, all three are.
#[inline(always)]
pub(crate) const fn switches(port_a: u16, port_c: u16) -> Switches {
    Switches::from_bits(
        axis_inputs(port_a, port_c, 0)
            | axis_inputs(port_a, port_c, 1) << BITS_PER_AXIS
            | axis_inputs(port_a, port_c, 2) << (2 * BITS_PER_AXIS)
            | (port_a & EMERGENCY_STOP) << 15,
    )
}

/// The reading of a sagging supply of the processor: the same as amplifiers that are not ready, as nothing that this
/// processor says should drive them any more.
pub(crate) const SUPPLY_LOW: Switches = Switches::of_axes([AxisSwitches::AMPLIFIER_FAULT; 3]);

/// Limits, home and fault of one axis, in the lowest four bits.
#[inline(always)]
const fn axis_inputs(port_a: u16, port_c: u16, axis: u32) -> u16 {
    let limits = port_c >> (FIRST_LIMIT + 2 * axis) & 0b11;
    let home = port_c >> (FIRST_HOME + axis) & 1;
    let fault = (port_a >> (FIRST_FAULT + axis) | port_a >> 1) & 1;
    limits | home << 2 | fault << 3
}

/// The cause of a reset from RCC_CSR (RM0390, 6.3.21). Every reset pulls the reset pin, too, and power-on sets the
/// brown-out flag as well: the more special flag decides.
pub(crate) const fn reset_cause(csr: u32) -> ResetCause {
    const LOW_POWER: u32 = 1 << 31;
    const WINDOW_WATCHDOG: u32 = 1 << 30;
    const INDEPENDENT_WATCHDOG: u32 = 1 << 29;
    const SOFTWARE: u32 = 1 << 28;
    const POWER_ON: u32 = 1 << 27;
    const PIN: u32 = 1 << 26;
    const BROWN_OUT: u32 = 1 << 25;
    if csr & LOW_POWER != 0 {
        ResetCause::LowPower
    } else if csr & (WINDOW_WATCHDOG | INDEPENDENT_WATCHDOG) != 0 {
        ResetCause::Watchdog
    } else if csr & SOFTWARE != 0 {
        ResetCause::Software
    } else if csr & POWER_ON != 0 {
        ResetCause::PowerOn
    } else if csr & BROWN_OUT != 0 {
        ResetCause::BrownOut
    } else if csr & PIN != 0 {
        ResetCause::Pin
    } else {
        ResetCause::Unknown
    }
}
