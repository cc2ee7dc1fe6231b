//! An allocator that ends the test where a thread allocates that must not.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static FORBIDDEN: Cell<bool> = const { Cell::new(false) };
}

struct Forbidding;

// SAFETY: it is the system's allocator, or the end of the process.
unsafe impl GlobalAlloc for Forbidding {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        check();
        // SAFETY: as the caller says.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        check();
        // SAFETY: as the caller says.
        unsafe { System.dealloc(pointer, layout) }
    }
}

fn check() {
    if FORBIDDEN.get() {
        FORBIDDEN.set(false);
        eprintln!("memory was allocated or freed in the realtime function");
        std::process::abort();
    }
}

#[global_allocator]
static ALLOCATOR: Forbidding = Forbidding;

/// Does something that must neither allocate nor free.
pub(crate) fn without_allocation<T>(work: impl FnOnce() -> T) -> T {
    FORBIDDEN.set(true);
    let result = work();
    FORBIDDEN.set(false);
    result
}
