//! The link over TCP: one client at a time, and nothing waits.

use std::io::{ErrorKind, Read, Result, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use quadrant::hal::Serial;

/// Silence after which a client gives way to another one.
const SILENT: Duration = Duration::from_secs(10);

/// Bytes that a client may have waiting, each request being answered before the next: the one that has more is sent away.
const MOST_WAITING: usize = 16 * 1024;

/// A listening socket, as a port that never waits.
pub(crate) struct Port {
    listener: Option<TcpListener>,
    client: Option<TcpStream>,
    /// Time at which the client last sent something.
    heard: Instant,
    /// Place for what is waiting.
    waiting: Box<[u8]>,
}

impl Port {
    /// Listens at an address; at none without one.
    pub(crate) fn listen(address: Option<&str>) -> Result<Self> {
        let listener = address.map(TcpListener::bind).transpose()?;
        if let Some(listener) = &listener {
            listener.set_nonblocking(true)?;
        }
        Ok(Self {
            listener,
            client: None,
            heard: Instant::now(),
            waiting: vec![0; MOST_WAITING].into(),
        })
    }

    /// Lets a client in, if there is none, or one that has left or been silent; else it is sent away.
    fn accept(&mut self) {
        let Some(Ok((stream, _))) = self.listener.as_ref().map(TcpListener::accept) else {
            return;
        };
        let stays = self.client.as_ref().is_some_and(|client| {
            let here = match client.peek(&mut [0]) {
                Ok(count) => count > 0,
                Err(error) => error.kind() == ErrorKind::WouldBlock,
            };
            here && self.heard.elapsed() < SILENT
        });
        if !stays && stream.set_nonblocking(true).is_ok() {
            self.heard = Instant::now();
            // Small frames go at once; without it they only go later.
            let _ = stream.set_nodelay(true);
            self.client = Some(stream);
        }
    }

    /// Counts what was exchanged, and lets a client go that has left.
    fn exchanged(&mut self, result: Result<usize>) -> usize {
        match result {
            Ok(count) if count > 0 => count,
            Err(error)
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) =>
            {
                0
            }
            _ => {
                self.client = None;
                0
            }
        }
    }
}

impl Serial for Port {
    fn read(&mut self, into: &mut [u8]) -> usize {
        self.accept();
        let Some(client) = &mut self.client else {
            return 0;
        };
        if client
            .peek(&mut self.waiting)
            .is_ok_and(|count| count == MOST_WAITING)
        {
            self.client = None;
            return 0;
        }
        let read = client.read(into);
        let count = self.exchanged(read);
        if count > 0 {
            self.heard = Instant::now();
        }
        count
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        let Some(client) = &mut self.client else {
            // Nobody listens: what was meant for the last client is dropped.
            return bytes.len();
        };
        if bytes.is_empty() {
            return 0;
        }
        let written = client.write(bytes);
        self.exchanged(written)
    }
}

#[cfg(test)]
mod tests {
    use super::{Port, SILENT, Serial};
    use std::io::Write;
    use std::net::TcpStream;
    use std::time::{Duration, Instant};

    /// Reads until something comes, for a second.
    fn read(port: &mut Port) -> Vec<u8> {
        let mut bytes = [0; 16];
        for _ in 0..200 {
            let count = port.read(&mut bytes);
            if count > 0 {
                return bytes[..count].to_vec();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Vec::new()
    }

    fn connect(port: &Port, words: &[u8]) -> TcpStream {
        let address = port.listener.as_ref().unwrap().local_addr().unwrap();
        let mut client = TcpStream::connect(address).unwrap();
        client.write_all(words).unwrap();
        client
    }

    #[test]
    fn a_client_is_served_right_after_another_one_has_left() {
        let mut port = Port::listen(Some("127.0.0.1:0")).unwrap();
        for words in [b"one", b"two", b"six"] {
            let client = connect(&port, words);
            assert_eq!(read(&mut port), words);
            drop(client);
        }
    }

    #[test]
    fn a_client_that_floods_gives_way_to_the_next_at_once() {
        let mut port = Port::listen(Some("127.0.0.1:0")).unwrap();
        let flood = connect(&port, &[1; 60_000]);
        std::thread::sleep(Duration::from_millis(50));
        while port.read(&mut [0; 16]) > 0 {}
        let _next = connect(&port, b"six");
        assert_eq!(read(&mut port), b"six");
        drop(flood);
    }

    #[test]
    fn a_client_that_is_silent_gives_way_to_another_and_one_that_is_not_stays() {
        let mut port = Port::listen(Some("127.0.0.1:0")).unwrap();
        let mut first = connect(&port, b"one");
        assert_eq!(read(&mut port), b"one");
        let _sent_away = connect(&port, b"two");
        first.write_all(b"more").unwrap();
        assert_eq!(read(&mut port), b"more");
        port.heard = Instant::now() - SILENT;
        let _second = connect(&port, b"six");
        assert_eq!(read(&mut port), b"six");
    }
}
