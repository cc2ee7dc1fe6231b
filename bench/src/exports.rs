//! The functions that the page calls, over WebAssembly's linear memory.
//!
//! A function that answers leaves bytes or numbers, returns where, and [`length`] returns the number of bytes; they stay until the
//! next call. One bench and one session with a machine live in the instance, which has one thread.
//!
//! The only `unsafe` here is that of giving a function its plain name: no pointer is followed on this side.

use std::cell::RefCell;

use serde_json::{Value, json};

use crate::bench::Bench;
use crate::request::answer;
use crate::session::{self, Session};

/// The bench, the session with a machine, and what is exchanged with the page.
#[derive(Default)]
struct Exchange {
    bench: Bench,
    session: Session,
    bytes: Vec<u8>,
    /// Bytes for the machine.
    frame: Vec<u8>,
    samples: Vec<f64>,
    length: usize,
}

impl Exchange {
    fn leave_bytes(&mut self) -> *const u8 {
        self.length = self.bytes.len();
        self.bytes.as_ptr()
    }

    fn leave_json(&mut self, value: &Value) -> *const u8 {
        self.bytes = value.to_string().into_bytes();
        self.leave_bytes()
    }

    fn leave_samples(&mut self) -> *const f64 {
        self.length = size_of_val(self.samples.as_slice());
        self.samples.as_ptr()
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
        exchange.leave_samples()
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

/// Begins a session with a machine and returns where the list of channels that can be sampled is.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn link_open() -> *const u8 {
    with(|exchange| {
        exchange.session = Session::default();
        exchange.leave_json(&session::channels())
    })
}

/// Makes the frame of the request that was written and returns where its number and name are, or the reason in words.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn link_ask() -> *const u8 {
    with(|exchange| {
        exchange.frame.clear();
        let asked = exchange.session.ask(&exchange.bytes, &mut exchange.frame);
        exchange.leave_json(&match asked {
            Ok(asked) => json!({ "ok": asked }),
            Err(error) => json!({ "error": error }),
        })
    })
}

/// Returns where the bytes for the machine are that the last request became.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn link_frame() -> *const u8 {
    with(|exchange| {
        exchange.length = exchange.frame.len();
        exchange.frame.as_ptr()
    })
}

/// Takes the bytes of the machine that were written and returns where its messages are.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn link_take() -> *const u8 {
    with(|exchange| {
        exchange.samples.clear();
        let messages = exchange
            .session
            .take(&exchange.bytes, &mut exchange.samples);
        exchange.leave_json(&Value::Array(messages))
    })
}

/// Returns where the samples are that the last bytes of the machine held.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn link_samples() -> *const f64 {
    with(Exchange::leave_samples)
}

/// Bytes that the last function left.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
extern "C" fn length() -> usize {
    with(|exchange| exchange.length)
}
