//! Bytes to a machine and back, and the clock by which they are waited for.

use std::io;
use std::time::Duration;

use quadrant_link::frame::{self, FRAME_BYTES};
use serde::Serialize;

use super::simulated_io::SimulatedIo;

/// A connection that carries bytes both ways, and the clock by which it waits.
pub trait Transport {
    /// Sends all of the bytes.
    ///
    /// # Errors
    /// A connection that is broken.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits until bytes have come, at most for `timeout` of its own clock, and says how many it wrote to `buffer`: 0 if
    /// none came.
    ///
    /// # Errors
    /// A connection that is broken.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// Its clock: the time since it was opened; of a simulated machine the machine's time.
    fn now(&self) -> Duration;

    /// Returns the other end, for messages: "serial port /dev/ttyACM0".
    fn endpoint(&self) -> String;

    /// Returns the remedy if the other end is silent.
    fn remedy(&self) -> &'static str;

    /// True if others look at the machine, and receive what this end receives.
    fn is_shared(&self) -> bool {
        false
    }

    /// True if another program holds the machine, and lets this one look at it.
    fn is_view(&self) -> bool {
        false
    }

    /// Inputs, supply and log of the machine, where a program can have them: of a simulated one.
    fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        None
    }
}

/// The bytes of a message of the link, as they are sent.
///
/// # Panics
/// Never: every message fits a frame.
pub fn encoded(message: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; FRAME_BYTES];
    frame::encode(message, &mut buffer)
        .expect("every message fits a frame")
        .to_vec()
}
