//! Description of the chip for RTIC, with the interrupts we use named by role.
//!
//! The vector table itself is the chip crate's; `roles.x` declares to the linker which entry plays which role.

use stm32f4xx_hal::pac;

pub(crate) use stm32f4xx_hal::pac::NVIC_PRIO_BITS;

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
    CONTROL_TICK = pac::Interrupt::TIM7 as u16,
    /// A task dispatcher, on a vector of the CAN controller, which we leave switched off.
    DISPATCHER_0 = pac::Interrupt::CAN1_TX as u16,
    /// A task dispatcher, likewise.
    DISPATCHER_1 = pac::Interrupt::CAN1_RX0 as u16,
    /// A task dispatcher, likewise.
    DISPATCHER_2 = pac::Interrupt::CAN1_RX1 as u16,
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
