//! A guard below the stack: there is nothing on a real chip, and so the processor faults there; the emulator has a region that
//! swallows what is written. The memory protection unit makes it fault here, too.

use cortex_m::peripheral::MPU;

/// Lowest address of the guard; it ends where the stack does, at the bottom of RAM.
const BASE: u32 = 0x1FF0_0000;
/// Region attributes: no access, no execution, 2^20 bytes, enabled.
const NO_ACCESS: u32 = 1 << 28 | 19 << 1 | 1;
/// Control: everything else as without the unit; enabled.
const ENABLE: u32 = 1 << 2 | 1;

/// Guards the end of the stack.
pub(super) fn start(unit: &MPU) {
    // SAFETY: no Rust object lies in the region, nor does any of them need the rights that it takes away.
    unsafe {
        unit.rnr.write(0);
        unit.rbar.write(BASE);
        unit.rasr.write(NO_ACCESS);
        unit.ctrl.write(ENABLE);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
