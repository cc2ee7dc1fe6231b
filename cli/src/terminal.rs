//! Standard output and standard error, which may be closed or full: the work goes on, and its files are written.
//!
//! [`say!`](crate::say) and [`warn!`](crate::warn) stand in for `println!` and `eprintln!`, which panic there.

use std::fmt::Arguments;
use std::io::{self, Write};
use std::sync::Mutex;

/// The first error of standard output.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints a line to standard output.
#[macro_export]
macro_rules! say {
    () => { $crate::terminal::print(format_args!("\n")) };
    ($($what:tt)*) => { $crate::terminal::print(format_args!("{}\n", format_args!($($what)*))) };
}

/// Prints a line to standard error.
#[macro_export]
macro_rules! warn {
    ($($what:tt)*) => { $crate::terminal::print_error(format_args!("{}\n", format_args!($($what)*))) };
}

/// Prints to standard output, unless that has failed before.
pub fn print(what: Arguments<'_>) {
    let Ok(mut failed) = FAILED.lock() else {
        return;
    };
    if failed.is_none() {
        let mut out = io::stdout().lock();
        *failed = out.write_fmt(what).and_then(|()| out.flush()).err();
    }
}

/// Prints to standard error, if that can be.
pub fn print_error(what: Arguments<'_>) {
    // There is nowhere left to tell it.
    let _ = io::stderr().lock().write_fmt(what);
}

/// Says whether everything was printed.
///
/// # Errors
/// A device that is full, say. A reader that has seen enough, such as `head`, is none.
pub fn finish() -> anyhow::Result<()> {
    match FAILED.lock().ok().and_then(|mut failed| failed.take()) {
        Some(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("cannot write to standard output"))
        }
        _ => Ok(()),
    }
}
