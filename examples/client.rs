//! A client of the link: says hello, and asks for the status.
//!
//! `cargo run --example client` talks to a server in this process; with the path of a serial port that is set to the
//! board's baud rate (`stty -F /dev/ttyACM0 921600 raw`), `cargo run --example client -- /dev/ttyACM0` talks to a board.

use std::collections::VecDeque;
use std::error::Error;
use std::fs::OpenOptions;
use std::io::{self, Read, Write};

use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::frame::{self, DELIMITER, FRAME_BYTES, Receiver};
use quadrant_link::message::{Body, Identity, LinkError, Message, NumberType};
use quadrant_link::message::{Reply, Request, text};
use quadrant_link::server::LinkServer;

/// Sends a request and waits for its response; notices that come first are passed over.
fn ask(port: &mut (impl Read + Write), id: u16, body: Body) -> Result<Reply, Box<dyn Error>> {
    let mut buffer = [0; FRAME_BYTES];
    port.write_all(frame::encode(&Request { id, body }, &mut buffer)?)?;
    let (mut receiver, mut byte) = (Receiver::new(), [0]);
    loop {
        port.read_exact(&mut byte)?;
        if let Some(payload) = receiver.push(byte[0])
            && let Message::Response(response) = frame::decode(payload)?
            && response.id == id
        {
            return Ok(response.result?);
        }
    }
}

/// A server in this process, in the place of a board.
#[derive(Default)]
struct Loopback {
    server: LinkServer,
    answers: VecDeque<u8>,
}

fn serve(body: Body) -> Result<Reply, LinkError> {
    match body {
        Body::Hello => Ok(Reply::Identity(Identity {
            protocol: PROTOCOL_VERSION,
            firmware: text(format_args!("example")),
            board: text(format_args!("loopback")),
            rate_hz: 1e4,
            cycle_hz: 1_000_000,
            number: NumberType::F32,
            tick: 0,
        })),
        other => Err(LinkError::Unsupported(text(format_args!(
            "{}",
            other.name()
        )))),
    }
}

impl Read for Loopback {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.answers.read(into)
    }
}

impl Write for Loopback {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for response in bytes
            .iter()
            .filter_map(|&byte| self.server.push(byte, serve))
        {
            let mut buffer = [0; FRAME_BYTES];
            let sent = frame::encode(&Message::Response(response), &mut buffer);
            self.answers.extend(sent.map_err(io::Error::other)?);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn session(mut port: impl Read + Write) -> Result<(), Box<dyn Error>> {
    // Ends whatever the line has carried so far.
    port.write_all(&[DELIMITER])?;
    println!("{:?}", ask(&mut port, 1, Body::Hello)?);
    match ask(&mut port, 2, Body::Status) {
        Ok(status) => println!("{status:?}"),
        Err(error) => println!("{error}"),
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1) {
        Some(path) => session(OpenOptions::new().read(true).write(true).open(path)?),
        None => session(Loopback::default()),
    }
}
