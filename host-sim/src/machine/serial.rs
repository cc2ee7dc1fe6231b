//! A board at a serial port.

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use super::claim::Claim;
use super::stream::{LEAST_TIMEOUT, TIMEOUT, ended, or_none};
use super::transport::Transport;

/// The speed of the serial port, baud; 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 921_600;

/// A serial port, such as a board's debugger offers.
pub struct SerialTransport {
    port: Box<dyn serialport::SerialPort>,
    path: String,
    opened: Instant,
    _claim: Claim,
}

impl SerialTransport {
    /// Opens a port by its path, such as `/dev/ttyACM0` or `COM3`, at [`BAUD`].
    ///
    /// # Errors
    /// A port that is not there, held by another program, or forbidden.
    pub fn open(path: &str) -> io::Result<Self> {
        let claim = Claim::take(path)?;
        let port = serialport::new(path, BAUD).timeout(TIMEOUT).open()?;
        Ok(Self {
            port,
            path: path.to_owned(),
            opened: Instant::now(),
            _claim: claim,
        })
    }
}

impl Transport for SerialTransport {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(TIMEOUT)?;
        self.port.write_all(bytes)?;
        self.port.flush()
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.port.set_timeout(timeout.max(LEAST_TIMEOUT))?;
        match self.port.read(buffer) {
            // A port that is there gives bytes or times out; the end of it is a cable that was pulled.
            Ok(0) => Err(ended()),
            read => or_none(read),
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn endpoint(&self) -> String {
        format!("serial port {}", self.path)
    }

    fn remedy(&self) -> &'static str {
        "check that the board has power and Quadrant's firmware (`quadrant connect flash`), and that this is its port"
    }
}
