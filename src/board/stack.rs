//! High-water mark of the stack.
//!
//! The stack lies below everything else in RAM: one that grows too far meets addresses where there is no memory, and the
//! processor faults instead of overwriting variables. The start-up code fills it with a pattern; what still holds it was
//! never used.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    /// The lowest address of the stack, from the board's linker script.
    static mut _stack_end: u32;
    /// The address above its highest.
    static mut _stack_start: u32;
}

/// Bytes of the stack.
pub(crate) fn size() -> usize {
    (&raw const _stack_start as usize) - (&raw const _stack_end as usize)
}

/// True if the eight words that an exception leaves at this address are inside the stack.
pub(super) fn holds(frame: usize) -> bool {
    let (bottom, top) = (
        &raw const _stack_end as usize,
        &raw const _stack_start as usize,
    );
    frame >= bottom && frame.checked_add(32).is_some_and(|end| end <= top)
}

/// Most bytes of the stack that were ever in use. Looks at every word that was not: for slow tasks.
pub(crate) fn high_water() -> usize {
    let bottom = &raw const _stack_end;
    let words = size() / 4;
    let untouched = (0..words)
        // SAFETY: a word of the stack below what is in use; nothing else is there.
        .take_while(|word| unsafe { bottom.add(*word).read_volatile() } == STACK_PAINT_VALUE)
        .count();
    4 * (words - untouched)
}
