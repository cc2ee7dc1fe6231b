//! Long computations without Python's lock, which Ctrl-C ends.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
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
            scope.spawn(move || send_result(&done, || on_all_cores(|| work(flag))));
            wait(&ended, &cancelled)
        })
    })
}

/// The same for work that looks at the flag seldom or never: at an interrupt it is left to end by itself, in the background.
///
/// # Errors
/// As [`cancellable`].
pub(crate) fn left_behind<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send + 'static,
) -> PyResult<T> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&cancelled);
    let (done, ended) = channel();
    thread::spawn(move || send_result(&done, || on_all_cores(|| work(&flag))));
    py.detach(move || wait(&ended, &cancelled))
}

/// Runs work on threads of this call alone. A pool that calls share would have no threads in a process that was forked, and would wait for
/// them indefinitely.
fn on_all_cores<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = rayon::ThreadPoolBuilder::new().build();
    let pool = pool.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    Ok(pool.install(work))
}

/// Sends the result of work. A panic closes the channel; its message is on standard error.
fn send_result<T>(done: &Sender<PyResult<T>>, work: impl FnOnce() -> PyResult<T>) {
    if let Ok(result) = catch_unwind(AssertUnwindSafe(work)) {
        // Nobody waits for it after an interrupt.
        let _ = done.send(result);
    }
}

/// Waits for a result, and looks for signals meanwhile.
fn wait<T>(ended: &Receiver<PyResult<T>>, cancelled: &AtomicBool) -> PyResult<T> {
    loop {
        match ended.recv_timeout(LOOK) {
            Ok(result) => return result,
            Err(RecvTimeoutError::Timeout) => {
                if let Err(error) = Python::attach(|py| py.check_signals()) {
                    cancelled.store(true, Ordering::Relaxed);
                    return Err(error);
                }
            }
            Err(RecvTimeoutError::Disconnected) => return Err(panicked()),
        }
    }
}

/// The error of a computation that has panicked.
fn panicked() -> PyErr {
    PyRuntimeError::new_err("the computation has panicked: report it with what was computed")
}
