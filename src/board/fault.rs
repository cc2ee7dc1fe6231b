//! The last resort: panics, hard faults and interrupts nobody asked for.
//!
//! All three do the same, in this order: outputs to zero and amplifiers disabled; then the text; then the end.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::{ExceptionFrame, exception};

use super::{Outcome, halt, outputs_off};

/// Makes the machine safe, then says why, then ends.
fn fail(explain: impl FnOnce()) -> ! {
    // A second fault comes from the explanation itself: by then the outputs are off, so stay silent.
    static EXPLAINING: AtomicBool = AtomicBool::new(false);

    cortex_m::interrupt::disable();
    outputs_off();
    if !EXPLAINING.swap(true, Ordering::Relaxed) {
        explain();
    }
    halt(Outcome::Failed)
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    fail(|| defmt::error!("panic, outputs are off: {}", defmt::Display2Format(info)))
}

// SAFETY: `cortex-m-rt` calls this with the frame the processor stacked; nothing is assumed of the interrupted code,
// and it is never returned to.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    fail(|| defmt::error!("hard fault at {=u32:#010x}, outputs are off", frame.pc()))
}

// SAFETY: as for `HardFault`.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    fail(|| defmt::error!("interrupt {=i16} has no handler, outputs are off", number))
}
