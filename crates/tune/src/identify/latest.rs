//! The latest results of a computation that a search asks for again.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The latest results, the newest first; several threads may ask at once.
#[derive(Debug)]
pub(super) struct Latest<T> {
    room: usize,
    kept: Mutex<VecDeque<T>>,
}

impl<T: Clone> Latest<T> {
    /// None yet, and at most `room` of them, 1 or more.
    pub(super) fn new(room: usize) -> Self {
        Self {
            room,
            kept: Mutex::default(),
        }
    }

    /// The newest result that `is_it` accepts.
    pub(super) fn find(&self, is_it: impl Fn(&T) -> bool) -> Option<T> {
        self.kept().iter().find(|result| is_it(result)).cloned()
    }

    /// Keeps a result, in the place of the oldest one where there is no room.
    pub(super) fn keep(&self, result: T) {
        let mut kept = self.kept();
        kept.truncate(self.room - 1);
        kept.push_front(result);
    }

    fn kept(&self) -> MutexGuard<'_, VecDeque<T>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
