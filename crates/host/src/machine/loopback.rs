//! A transport to a simulated machine, whose time passes only while it is waited for.

use std::fmt;
use std::io;
use std::time::Duration;

use super::simulated_io::SimulatedIo;
use super::transport::Transport;

/// A machine in this process, or one that runs in step with it.
pub trait SimulatedPeer {
    /// Lets the machine run for [`period`](Self::period), with bytes for it; gives its bytes.
    ///
    /// # Errors
    /// A machine that has failed.
    fn exchange(&mut self, sent: &[u8]) -> io::Result<Vec<u8>>;

    /// The machine's time that one exchange takes.
    fn period(&self) -> Duration;

    /// Name of the machine, for messages.
    fn endpoint(&self) -> String {
        "the simulated machine".to_owned()
    }

    /// Returns the simulated inputs, supply and log, if it has them.
    fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        None
    }
}

/// A machine in this process as the other end. Its time passes only while it is waited for, as fast as it can, so that the
/// same commands give the same bytes.
pub struct Loopback<E> {
    machine: E,
    sent: Vec<u8>,
    received: Vec<u8>,
    now: Duration,
}

impl<E: SimulatedPeer> Loopback<E> {
    /// The machine, before its first exchange.
    pub const fn new(machine: E) -> Self {
        Self {
            machine,
            sent: Vec::new(),
            received: Vec::new(),
            now: Duration::ZERO,
        }
    }
}

impl<E: SimulatedPeer> Transport for Loopback<E> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sent.extend_from_slice(bytes);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let due = self.now + timeout;
        while self.received.is_empty() && (self.now < due || !self.sent.is_empty()) {
            let sent = std::mem::take(&mut self.sent);
            self.received = self.machine.exchange(&sent)?;
            self.now += self.machine.period();
        }
        let count = self.received.len().min(buffer.len());
        for (place, byte) in buffer.iter_mut().zip(self.received.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn endpoint(&self) -> String {
        self.machine.endpoint()
    }

    fn remedy(&self) -> &'static str {
        "this is a defect of Quadrant: please report the commands that led to it"
    }

    fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        self.machine.simulated_io()
    }
}

impl<E> fmt::Debug for Loopback<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Loopback").field("now", &self.now).finish()
    }
}
