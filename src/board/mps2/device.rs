//! Description of the chip for RTIC and `cortex-m-rt`: a hand-made device crate, as none exists for this machine.

/// Priority bits implemented by the interrupt controller.
pub(crate) const NVIC_PRIO_BITS: u8 = 3;

/// The interrupts the application uses, named by role.
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
    /// A low-priority task dispatcher, on the vector of UART 2's receiver.
    DISPATCHER_0 = 4,
    /// A task dispatcher, on the vector of UART 2's transmitter.
    DISPATCHER_1 = 5,
    /// A task dispatcher, on the vector of GPIO port 0.
    DISPATCHER_2 = 6,
    /// The control tick: timer 0, or pended by software.
    CONTROL_TICK = 8,
    /// Timer 1 runs free: its interrupt has no handler.
    WITHOUT_HANDLER = 9,
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

unsafe extern "C" {
    fn CONTROL_TICK();
    fn DISPATCHER_0();
    fn DISPATCHER_1();
    fn DISPATCHER_2();
    fn DefaultHandler();
}

/// The vectors of the first 16 interrupt lines.
// SAFETY: the section is the one in which `cortex-m-rt` expects the table, and the name the one it keeps.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); 16] = {
    let mut table: [unsafe extern "C" fn(); 16] = [DefaultHandler; 16];
    table[Interrupt::DISPATCHER_0 as usize] = DISPATCHER_0;
    table[Interrupt::DISPATCHER_1 as usize] = DISPATCHER_1;
    table[Interrupt::DISPATCHER_2 as usize] = DISPATCHER_2;
    table[Interrupt::CONTROL_TICK as usize] = CONTROL_TICK;
    table
};
