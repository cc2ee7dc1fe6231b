//! Long computations without Python's lock, which Ctrl-C ends.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Time between two looks for signals.
const LOOK: Duration = Duration::from_millis(50);

/// Runs `work` on a thread of its own, without Python's lock, and looks for signals meanwhile. At an interrupt the flag becomes true:
/// `work` returns soon, and its result is dropped.
///
/// # Errors
/// `KeyboardInterrupt`, or what a handler of a signal raises.
pub(crate) fn cancellable<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let cancelled = AtomicBool::new(false);
    py.detach(|| {
        thread::scope(|scope| {
            let (done, ended) = channel();
            let flag = &cancelled;
            scope.spawn(move || {
                // A panic closes the channel; its message is on standard error.
                if let Ok(result) = catch_unwind(AssertUnwindSafe(|| work(flag))) {
                    let _ = done.send(result);
                }
            });
            loop {
                match ended.recv_timeout(LOOK) {
                    Ok(result) => return Ok(result),
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(error) = Python::attach(|py| py.check_signals()) {
                            cancelled.store(true, Ordering::Relaxed);
                            return Err(error);
                        }
                    }
                    Err(RecvTimeoutError::Disconnected) => return Err(panicked()),
                }
            }
        })
    })
}

/// The error of a computation that has panicked.
fn panicked() -> PyErr {
    PyRuntimeError::new_err("the computation has panicked: report it with what was computed")
}
