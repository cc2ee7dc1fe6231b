//! A machine behind a socket.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use quadrant_link::frame::DELIMITER;

use super::claim::Claim;
use super::stream::{LEAST_TIMEOUT, TIMEOUT, ended, or_none};
use super::transport::Transport;

/// A socket: a port that is shared over a network, or an emulator's.
pub struct TcpTransport {
    stream: TcpStream,
    address: String,
    opened: Instant,
    /// None of a machine that another program holds.
    claim: Option<Claim>,
}

impl TcpTransport {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// An address that is none, where nobody answers within 5 s, or to which another program talks.
    pub fn connect(address: &str) -> io::Result<Self> {
        let claim = Claim::socket(address)?;
        Self::open(address, Some(claim))
    }

    /// Connects to `host:port`, where another program lets others look at its machine; beyond its own computer, those who have
    /// its token.
    ///
    /// # Errors
    /// An address that is none, or where nobody answers within 5 s.
    pub fn look(address: &str, token: Option<&str>) -> io::Result<Self> {
        let mut looking = Self::open(address, None)?;
        if let Some(token) = token {
            looking.send(&[token.as_bytes(), &[DELIMITER]].concat())?;
        }
        Ok(looking)
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
                        claim,
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

    fn is_view(&self) -> bool {
        self.claim.is_none()
    }

    fn remedy(&self) -> &'static str {
        if self.is_view() {
            return "the program that holds the machine has ended, stands, or lets as many look as it may; the machine may go on, and \
                    its own stop is the one to use";
        }
        "check that the machine behind this address runs, and that nobody else is connected to it"
    }
}
