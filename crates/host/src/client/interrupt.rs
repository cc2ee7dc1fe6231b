//! A person's wish to stop, from outside of what is under way.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Requests to stop on which a session has not acted yet; clones are one. A signal's handler makes them, and the [`Client`]
/// acts on them wherever it waits for the machine: the first stops the axes, a second disables the outputs.
///
/// [`Client`]: super::Client
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<Requests>);

#[derive(Debug, Default)]
struct Requests {
    /// Requests on which nobody has acted yet.
    waiting: AtomicU32,
    /// Requests since a person gave the last command.
    all: AtomicU32,
    /// The program is to end.
    ends: AtomicBool,
}

impl Interrupt {
    /// Asks to stop; returns the number of requests since the last command, acted on or not, this one included.
    pub fn request(&self) -> u32 {
        self.0.waiting.fetch_add(1, Ordering::Relaxed);
        self.0.all.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Asks to stop, and the program to end; as [`request`](Self::request).
    pub fn request_end(&self) -> u32 {
        self.0.ends.store(true, Ordering::Relaxed);
        self.request()
    }

    /// True if the program was asked to end.
    pub fn ends(&self) -> bool {
        self.0.ends.load(Ordering::Relaxed)
    }

    /// Takes the requests that wait.
    pub(super) fn take(&self) -> u32 {
        self.0.waiting.swap(0, Ordering::Relaxed)
    }

    /// Counts again from zero: a person has given another command.
    pub(super) fn forget(&self) {
        self.0.all.store(0, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::Interrupt;

    #[test]
    fn a_request_is_the_second_though_the_first_was_acted_on() {
        let interrupt = Interrupt::default();
        assert_eq!(interrupt.request(), 1);
        assert_eq!(interrupt.take(), 1);
        assert_eq!(interrupt.request(), 2);
        assert_eq!(interrupt.take(), 1);
        interrupt.forget();
        assert_eq!(interrupt.request(), 1);
    }
}
