//! Times of the converter's bus. No registers here: the tests of the library include this file and run it on the host.

use quadrant::drivers::ad5754r::steps::Hardware;

/// Clock of timer 8: twice that of APB 2 (RM0433, figure 49 and table 56, TIMPRE = 0).
pub(crate) const TIMER_HZ: u32 = 240_000_000;
/// Kernel clock of SPI 1: output Q of PLL 1.
pub(crate) const SPI_HZ: u32 = 48_000_000;

/// The bus while the converter receives, at up to 30 MHz: the kernel clock divided by two.
pub(crate) const WRITING: Hardware = hardware(2);
/// The bus while the converter answers: divided by eight. A quarter would leave 42 ns from edge to edge, of which SDO may
/// take 40 ns and the processor's input needs some.
pub(crate) const READING: Hardware = hardware(8);

/// The bus at a divider of its kernel clock, a fifth of the timer's. The SPI starts within five of its clock's periods, as a byte
/// crosses from the bus' clock to it, and a bit. A DMA write may be held up by two accesses of others to a bridge, of 12 cycles each,
/// and by 12 cycles on its way from domain 2 to the ports in domain 3; the manual has no figure for that.
const fn hardware(divider: u32) -> Hardware {
    const KERNEL_CYCLES: u32 = TIMER_HZ / SPI_HZ;
    Hardware {
        timer_hz: TIMER_HZ,
        bit_cycles: KERNEL_CYCLES * divider,
        start_cycles: KERNEL_CYCLES * (5 + divider),
        late_cycles: 36,
    }
}
