//! The CMSDK APB watchdog: a 32-bit down-counter. At zero it raises the non-maskable interrupt and starts again; at the
//! second zero it resets the processor.

use cortex_m_rt::exception;
use quadrant::hal;
use quadrant_lockstep::{Mode, RESET, Reset};

use super::{mailbox, timer};

const BASE: u32 = 0x4000_8000;
const LOAD: u32 = 0x000;
const CONTROL: u32 = 0x008;
const CLEAR_INTERRUPT: u32 = 0x00C;
const LOCK: u32 = 0xC00;

/// Lock register: gives access to the others.
const UNLOCK: u32 = 0x1ACC_E551;
/// Control register: count, and interrupt at zero.
const CONTROL_COUNT: u32 = 1;
/// Control register: reset at the second zero.
const CONTROL_RESET: u32 = 1 << 1;
/// Cycles to each of the two zeros: together 10 ms, as on the reference board.
const HALF: u32 = timer::CLOCK_HZ / 200;

/// The watchdog. Only the timer paces the firmware by a clock that this one's agrees with: in the other modes it is
/// never started, or a host that is slow would make it bite.
pub(crate) struct Watchdog {
    bites: bool,
}

impl Watchdog {
    /// The watchdog, not started.
    pub(super) fn new(mode: Mode) -> Self {
        Self {
            bites: mode == Mode::Paced,
        }
    }
}

fn write(register: u32, word: u32) {
    // SAFETY: the registers above are the watchdog's, which touches no memory.
    unsafe { core::ptr::write_volatile((BASE + register) as *mut u32, word) }
}

impl hal::Watchdog for Watchdog {
    fn start(&mut self) {
        if self.bites {
            write(LOCK, UNLOCK);
            write(LOAD, HALF);
            write(CONTROL, CONTROL_COUNT | CONTROL_RESET);
        }
    }

    fn feed(&mut self, _driving: bool) {
        if self.bites {
            write(CLEAR_INTERRUPT, 1);
        }
    }
}

// The machine has no register that says why it was reset; this is the last moment to write it down. The firmware is not
// informed: it hangs on until the second zero.
//
// SAFETY: it writes one word of the shared memory that no Rust object occupies, and assumes nothing of what it interrupts.
#[exception]
unsafe fn NonMaskableInt() {
    mailbox::write(RESET, Reset::Watchdog as u32);
}
