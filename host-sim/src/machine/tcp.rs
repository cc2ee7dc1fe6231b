//! A machine behind a socket.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::claim::Claim;
use super::stream::{LEAST_TIMEOUT, TIMEOUT, ended, or_none};
use super::transport::Transport;

/// A socket: a port that is shared over a network, or an emulator's.
pub struct TcpTransport {
    stream: TcpStream,
    address: String,
    opened: Instant,
    _claim: Option<Claim>,
}

impl TcpTransport {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// An address that is none, where nobody answers within 5 s, or to which another program talks.
    pub fn connect(address: &str) -> io::Result<Self> {
        let claim = Claim::take(address)?;
        Self::open(address, Some(claim))
    }

    /// Connects to `host:port`, where another program lets others look at its machine.
    ///
    /// # Errors
    /// An address that is none, or where nobody answers within 5 s.
    pub fn look(address: &str) -> io::Result<Self> {
        Self::open(address, None)
    }

    fn open(address: &str, claim: Option<Claim>) -> io::Result<Self> {
        let mut last = io::Error::new(io::ErrorKind::InvalidInput, "no such host");
        for candidate in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&candidate, TIMEOUT) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    stream.set_write_timeout(Some(TIMEOUT))?;
                    return Ok(Self {
                        stream,
                        address: address.to_owned(),
                        opened: Instant::now(),
                        _claim: claim,
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

    fn endpoint(&self) -> String {
        format!("tcp:{}", self.address)
    }

    fn remedy(&self) -> &'static str {
        "check that the machine behind this address runs, and that nobody else is connected to it"
    }
}
