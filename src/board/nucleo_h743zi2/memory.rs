//! Caches, and the memories that they leave alone.
//!
//! Stack and variables are in the DTCM, which no cache holds. What DMA streams read and write is in SRAM 1; the sectors of the
//! settings change under the caches. Both are excepted by the memory protection unit, as is the room below the stack.

use core::ptr::write_volatile;

use cortex_m::Peripherals;

/// MPU_RASR (Armv7-M, B3.5.9): enabled; size 2^(n+1) bytes (SIZE); eighths left out (SRD); accesses (AP); no execution (XN).
const ENABLED: u32 = 1;
const NO_EXECUTION: u32 = 1 << 28;
const FULL_ACCESS: u32 = 0b011 << 24;
const NO_ACCESS: u32 = 0b000 << 24;
/// Normal memory that no cache holds, shared (TEX = 001, S = 1, C = 0, B = 0).
const UNCACHED: u32 = 1 << 19 | 1 << 18;
/// Device memory (TEX = 000, S = 1, C = 0, B = 1): nothing is read ahead, no write is held back or merged with another.
const DEVICE: u32 = 1 << 18 | 1 << 16;
/// Sizes.
const KIB_64: u32 = 15 << 1;
const KIB_128: u32 = 16 << 1;
const KIB_256: u32 = 17 << 1;
const ALL: u32 = 31 << 1;
/// All eighths but those of external memories, 0x60000000 to 0xDFFFFFFF.
const BUT_EXTERNAL: u32 = 0b1000_0111 << 8;
/// MPU_CTRL (B3.5.5): the default map elsewhere (PRIVDEFENA), on.
const ON: u32 = 1 << 2 | 1;

/// First address and attributes; a later one goes before an earlier one.
const REGIONS: [(u32, u32); 4] = [
    // External memories, of which there are none: the core may read ahead there, and wait for ever (AN4838).
    (
        0,
        DEVICE | NO_ACCESS | NO_EXECUTION | BUT_EXTERNAL | ALL | ENABLED,
    ),
    // SRAM 1, `.dma` of the linker's map.
    (
        0x3000_0000,
        UNCACHED | FULL_ACCESS | NO_EXECUTION | KIB_128 | ENABLED,
    ),
    // The sectors of the settings: read while they change, and written word by word.
    (
        super::flash::START,
        DEVICE | FULL_ACCESS | NO_EXECUTION | KIB_256 | ENABLED,
    ),
    // Below the stack: there is no memory, and nothing may be taken for a slow answer.
    (
        0x1FFF_0000,
        DEVICE | NO_ACCESS | NO_EXECUTION | KIB_64 | ENABLED,
    ),
];

unsafe extern "C" {
    /// The first word that streams read or write, and the address behind the last.
    static mut _dma_start: u32;
    static mut _dma_end: u32;
}

/// Protects the regions, clears the streams' memory and starts both caches. SRAM 1 is clocked.
pub(super) fn start(core: &mut Peripherals) {
    for (number, (address, attributes)) in (0..).zip(REGIONS) {
        // SAFETY: the values are the manual's; what is excepted is no code, and nobody uses it yet.
        unsafe {
            core.MPU.rnr.write(number);
            core.MPU.rbar.write(address);
            core.MPU.rasr.write(attributes);
        }
    }
    // SAFETY: as above.
    unsafe { core.MPU.ctrl.write(ON) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    let first = &raw mut _dma_start;
    let words = (&raw mut _dma_end as usize - first as usize) / 4;
    for index in 0..words {
        // SAFETY: between the linker's marks, where nothing but the streams' memory is, and nobody uses it yet.
        unsafe { write_volatile(first.add(index), 0) };
    }
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}
