//! Times of the converter's bus. No registers here: the tests of the library include this file and run it on the host.

use quadrant::drivers::ad5754r::steps::Hardware;

/// Clock of timer 1: the processor's, as APB 2 runs at half of it.
pub(crate) const TIMER_HZ: u32 = 180_000_000;

/// The bus while the converter receives, at up to 30 MHz: 45 MHz divided by two.
pub(crate) const WRITING: Hardware = hardware(2);
/// The bus while the converter answers: 45 MHz divided by eight. A quarter would leave 44 ns from edge to edge, of which SDO may
/// take 40 ns and the processor's input needs some.
pub(crate) const READING: Hardware = hardware(8);

/// The bus at a divider of its clock, which is a quarter of the timer's. The SPI starts within three of its clock's periods and
/// a bit; a DMA write may be held up by two accesses of others to APB 1, of 12 cycles each.
const fn hardware(divider: u32) -> Hardware {
    Hardware {
        timer_hz: TIMER_HZ,
        bit_cycles: 4 * divider,
        start_cycles: 12 + 4 * divider,
        late_cycles: 24,
    }
}
