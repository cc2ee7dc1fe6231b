//! The functions that the page calls, over WebAssembly's linear memory.
//!
//! A function that answers leaves bytes or numbers, returns where, and [`length`] tells how many bytes; they stay until the
//! next call. One bench lives in the instance, which has one thread.
//!
//! The only `unsafe` here is that of giving a function its plain name: no pointer is followed on this side.

use std::cell::RefCell;

use crate::bench::Bench;
use crate::request::answer;

/// The bench, and what is exchanged with the page.
#[derive(Default)]
struct Exchange {
    bench: Bench,
    bytes: Vec<u8>,
    samples: Vec<f64>,
    length: usize,
}

impl Exchange {
    fn leave_bytes(&mut self) -> *const u8 {
        self.length = self.bytes.len();
        self.bytes.as_ptr()
    }
}

thread_local! {
    static EXCHANGE: RefCell<Exchange> = RefCell::default();
}

fn with<T>(act: impl FnOnce(&mut Exchange) -> T) -> T {
    EXCHANGE.with_borrow_mut(act)
}

/// Makes room for a request of `length` bytes and returns where it is to be written.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn room(length: usize) -> *mut u8 {
    with(|exchange| {
        exchange.bytes.clear();
        exchange.bytes.resize(length, 0);
        exchange.bytes.as_mut_ptr()
    })
}

/// Answers the request that was written and returns where the reply is.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn request() -> *const u8 {
    with(|exchange| {
        exchange.bytes = answer(&mut exchange.bench, &exchange.bytes);
        exchange.leave_bytes()
    })
}

/// Runs control periods and returns where their samples are.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn advance(ticks: u32) -> *const f64 {
    with(|exchange| {
        exchange.samples.clear();
        exchange.bench.advance(ticks, &mut exchange.samples);
        exchange.length = size_of_val(exchange.samples.as_slice());
        exchange.samples.as_ptr()
    })
}

/// Runs control periods and returns where the converters' words are.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn words(ticks: u32) -> *const u8 {
    with(|exchange| {
        exchange.bytes.clear();
        exchange.bench.words(ticks, &mut exchange.bytes);
        exchange.leave_bytes()
    })
}

/// Bytes that the last function left.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn length() -> usize {
    with(|exchange| exchange.length)
}
