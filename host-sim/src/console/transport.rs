//! How bytes get to a machine and back.

use std::fmt;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::hands::Hands;

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

    /// What is at the other end, for messages: "serial port /dev/ttyACM0".
    fn place(&self) -> String;

    /// What to check if the other end is silent.
    fn remedy(&self) -> &'static str;

    /// Hands at the machine, where a program can have any: at a simulated one.
    fn hands(&mut self) -> Option<&mut dyn Hands> {
        None
    }
}

/// The speed of the serial port, baud; 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 921_600;

/// Time for a connection to be made, and for bytes to be taken by the operating system.
const PATIENCE: Duration = Duration::from_secs(5);

/// The shortest time-out that sockets and ports know; zero would be none.
const LEAST_TIMEOUT: Duration = Duration::from_millis(1);

/// A serial port, such as a board's debugger offers.
pub struct SerialTransport {
    port: Box<dyn serialport::SerialPort>,
    path: String,
    opened: Instant,
}

impl SerialTransport {
    /// Opens a port by its path, such as `/dev/ttyACM0` or `COM3`, at [`BAUD`].
    ///
    /// # Errors
    /// A port that is not there, in use, or forbidden.
    pub fn open(path: &str) -> io::Result<Self> {
        let port = serialport::new(path, BAUD).timeout(PATIENCE).open()?;
        Ok(Self {
            port,
            path: path.to_owned(),
            opened: Instant::now(),
        })
    }
}

impl Transport for SerialTransport {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(PATIENCE)?;
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

    fn place(&self) -> String {
        format!("serial port {}", self.path)
    }

    fn remedy(&self) -> &'static str {
        "check that the board has power and Quadrant's firmware (`quadrant connect flash`), and that this is its port"
    }
}

/// A socket: a port that is shared over a network, or an emulator's.
pub struct TcpTransport {
    stream: TcpStream,
    address: String,
    opened: Instant,
}

impl TcpTransport {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// An address that is none, or where nobody answers within 5 s.
    pub fn connect(address: &str) -> io::Result<Self> {
        let mut last = io::Error::new(io::ErrorKind::InvalidInput, "no such host");
        for candidate in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&candidate, PATIENCE) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    stream.set_write_timeout(Some(PATIENCE))?;
                    return Ok(Self {
                        stream,
                        address: address.to_owned(),
                        opened: Instant::now(),
                    });
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

impl Transport for TcpTransport {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.stream
            .set_read_timeout(Some(timeout.max(LEAST_TIMEOUT)))?;
        match self.stream.read(buffer) {
            Ok(0) => Err(ended()),
            read => or_none(read),
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn place(&self) -> String {
        format!("tcp:{}", self.address)
    }

    fn remedy(&self) -> &'static str {
        "check that the machine behind this address runs, and that nobody else is connected to it"
    }
}

fn ended() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "the other end hung up")
}

/// A time-out is no bytes.
fn or_none(read: io::Result<usize>) -> io::Result<usize> {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    match read {
        Err(error) if matches!(error.kind(), TimedOut | WouldBlock | Interrupted) => Ok(0),
        other => other,
    }
}

/// A machine in this process, or one that runs in step with it.
pub trait Exchange {
    /// Lets the machine run for [`period`](Self::period), with bytes for it; gives its bytes.
    ///
    /// # Errors
    /// A machine that has failed.
    fn exchange(&mut self, sent: &[u8]) -> io::Result<Vec<u8>>;

    /// The machine's time that one exchange takes.
    fn period(&self) -> Duration;

    /// What it is, for messages.
    fn place(&self) -> String {
        "the simulated machine".to_owned()
    }

    /// Hands at it.
    fn hands(&mut self) -> Option<&mut dyn Hands> {
        None
    }
}

/// A machine in this process as the other end. Its time passes only while it is waited for, as fast as it can, so that the
/// same commands give the same bytes.
pub struct InProcess<E> {
    machine: E,
    sent: Vec<u8>,
    received: Vec<u8>,
    now: Duration,
}

impl<E: Exchange> InProcess<E> {
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

impl<E: Exchange> Transport for InProcess<E> {
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

    fn place(&self) -> String {
        self.machine.place()
    }

    fn remedy(&self) -> &'static str {
        "this is a defect of Quadrant: please report the commands that led to it"
    }

    fn hands(&mut self) -> Option<&mut dyn Hands> {
        self.machine.hands()
    }
}

impl<E> fmt::Debug for InProcess<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InProcess").field("now", &self.now).finish()
    }
}
