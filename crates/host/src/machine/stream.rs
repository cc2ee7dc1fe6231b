//! Rules that serial ports and sockets share as byte streams.

use std::io;
use std::time::Duration;

/// Time-out for a connection to be made, and for bytes to be taken by the operating system.
pub(super) const TIMEOUT: Duration = Duration::from_secs(5);

/// The shortest time-out that sockets and ports know; zero would be none.
pub(super) const LEAST_TIMEOUT: Duration = Duration::from_millis(1);

/// Error of a stream whose other end was closed.
pub(super) fn ended() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "the other end hung up")
}

/// A time-out is no bytes.
pub(super) fn or_none(read: io::Result<usize>) -> io::Result<usize> {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    match read {
        Err(error) if matches!(error.kind(), TimedOut | WouldBlock | Interrupted) => Ok(0),
        other => other,
    }
}
