//! A person's wish to stop, from outside of what is under way.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Requests to stop that a session has not heeded yet; clones are one. A signal's handler makes them, and the [`Client`]
/// heeds them wherever it waits for the machine: the first stops the axes, a second disables the outputs.
///
/// [`Client`]: super::Client
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicU32>);

impl Interrupt {
    /// Asks to stop; returns the number of requests that wait, this one included.
    pub fn request(&self) -> u32 {
        self.0.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Takes the requests that wait.
    pub(super) fn take(&self) -> u32 {
        self.0.swap(0, Ordering::Relaxed)
    }
}
