//! The last resort: panics, hard faults and interrupts nobody asked for.
//!
//! All three do the same, in this order: outputs to zero and amplifiers disabled; the crash record for the next start; the
//! same for the log; then the end.

use core::arch::naked_asm;
use core::fmt;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::exception;
use quadrant::app::crash_record::{CrashCause, CrashRecord};

use super::{Outcome, crash_record, halt, outputs_off, stack};
use crate::app::TICK;

/// Number of the non-maskable interrupt. On a board that has no handler for it, its clock security raises it.
const NON_MASKABLE: i16 = -14;

/// Makes the machine safe, records the cause, and ends.
fn fail(cause: CrashCause, text: fmt::Arguments) -> ! {
    // A second fault comes from the explanation itself: by then the outputs are off, so stay silent.
    static EXPLAINING: AtomicBool = AtomicBool::new(false);

    cortex_m::interrupt::disable();
    outputs_off();
    if !EXPLAINING.swap(true, Ordering::Relaxed) {
        let record = CrashRecord::new(cause, TICK.load(Ordering::Relaxed), text);
        crash_record::write(&record);
        defmt::error!(
            "{=str}, outputs are off: {=str}",
            cause.as_str(),
            record.text()
        );
    }
    halt(Outcome::Failed)
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    fail(CrashCause::Panic, format_args!("{info}"))
}

/// The hard fault's vector. It begins with a fresh stack, as the old one may be what failed: the interrupted code does
/// not return.
// SAFETY: the vector table's name and calling convention; it moves the stack pointer, hence naked, and never returns.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
#[unsafe(link_section = ".HardFault.user")]
unsafe extern "C" fn hard_fault_vector() -> ! {
    naked_asm!(
        "mov r0, sp",
        "ldr r1, =_stack_start",
        "mov sp, r1",
        "b {handler}",
        handler = sym hard_fault,
    )
}

/// `frame` is where the processor put the registers: the program counter is the seventh word.
extern "C" fn hard_fault(frame: usize) -> ! {
    if stack::holds(frame) {
        // SAFETY: inside the stack, and written by the processor a moment ago.
        let counter = unsafe { (frame as *const u32).add(6).read_volatile() };
        fail(CrashCause::HardFault, format_args!("at {counter:#010x}"))
    } else {
        fail(
            CrashCause::HardFault,
            format_args!("the stack is full: its pointer was {frame:#010x}"),
        )
    }
}

// SAFETY: `cortex-m-rt` calls this; nothing is assumed of the interrupted code, and it is never returned to.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    let cause = match number {
        NON_MASKABLE => CrashCause::ClockFailed,
        _ => CrashCause::StrayInterrupt,
    };
    fail(cause, format_args!("number {number}"))
}
