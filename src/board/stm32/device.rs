//! Description of the chip for RTIC, with the interrupts we use named by role.
//!
//! The vector table itself is the chip crate's; the board's `roles.x` declares to the linker which entry plays which role.

pub(crate) use crate::board::chip::pac::NVIC_PRIO_BITS;
use crate::board::chip::{CONTROL_TICK, DISPATCHERS};

/// The interrupts the application uses.
#[derive(Clone, Copy)]
#[repr(u16)]
#[expect(
    non_camel_case_types,
    reason = "these are also the names of linker symbols"
)]
#[allow(
    dead_code,
    reason = "which dispatchers are used is up to the application"
)]
pub(crate) enum Interrupt {
    /// The control tick: basic timer 7.
    CONTROL_TICK = CONTROL_TICK as u16,
    /// A task dispatcher, on a vector of the CAN controller, which we leave switched off.
    DISPATCHER_0 = DISPATCHERS[0] as u16,
    /// A task dispatcher, likewise.
    DISPATCHER_1 = DISPATCHERS[1] as u16,
    /// A task dispatcher, likewise.
    DISPATCHER_2 = DISPATCHERS[2] as u16,
}

// SAFETY: every number is a line of the interrupt controller, and `number` is constant for a variant.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    #[inline(always)]
    fn number(self) -> u16 {
        self as u16
    }
}

// RTIC refers to `device::interrupt::NAME`.
pub(crate) use self::Interrupt as interrupt;
