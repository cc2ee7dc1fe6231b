//! The link over TCP: one client at a time, and nothing waits.

use std::io::{ErrorKind, Read, Result, Write};
use std::net::{TcpListener, TcpStream};

use quadrant::hal::Serial;

/// A listening socket, as a port that never waits.
pub(crate) struct Port {
    listener: Option<TcpListener>,
    client: Option<TcpStream>,
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
        })
    }

    /// Lets a client in, if there is none; another one is sent away.
    fn accept(&mut self) {
        let Some(Ok((stream, _))) = self.listener.as_ref().map(TcpListener::accept) else {
            return;
        };
        if self.client.is_none() && stream.set_nonblocking(true).is_ok() {
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
        let read = client.read(into);
        self.exchanged(read)
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
