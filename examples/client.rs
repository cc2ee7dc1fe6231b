//! A client of the link: says hello, and asks for the status.
//!
//! `cargo run --example client` talks to a server in this process; with the path of a serial port that is set to the
//! board's baud rate (`stty -F /dev/ttyACM0 921600 raw`), `cargo run --example client -- /dev/ttyACM0` talks to a board.

use std::error::Error;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

use quadrant_link::frame::{self, DELIMITER, FRAME_BYTES, Receiver};
use quadrant_link::message::*;
use quadrant_link::{PROTOCOL_VERSION, server::LinkServer};

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

fn session(mut port: impl Read + Write) -> Result<(), Box<dyn Error>> {
    // Ends what the line has carried so far.
    port.write_all(&[DELIMITER])?;
    for (id, body) in (1..).zip([Body::Hello, Body::Status]) {
        println!("{:?}", ask(&mut port, id, body));
    }
    Ok(())
}

/// Answers hello like a board, and refuses everything else.
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

fn run_server(mut port: TcpStream) -> Option<()> {
    let (mut server, mut byte, mut buffer) = (LinkServer::new(), [0], [0; FRAME_BYTES]);
    loop {
        port.read_exact(&mut byte).ok()?;
        if let Some(response) = server.push(byte[0], serve) {
            let sent = frame::encode(&Message::Response(response), &mut buffer).ok()?;
            port.write_all(sent).ok()?;
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(path) = std::env::args().nth(1) {
        return session(OpenOptions::new().read(true).write(true).open(path)?);
    }
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    std::thread::spawn(move || {
        listener
            .accept()
            .ok()
            .and_then(|(port, _)| run_server(port))
    });
    session(TcpStream::connect(address)?)
}
