//! Sessions over a socket and over a serial port, with the model behind them.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use quadrant_link::message::Body;
use quadrant_link::message::MachineState;

use super::model::Model;
use crate::client::Client;
use crate::machine::{SimulatedPeer, TcpTransport, Transport};

/// Serves a line until it ends, or `requests` have been answered.
fn serve(mut line: impl Read + Write, requests: usize) {
    let (mut model, bench) = Model::new();
    let mut buffer = [0; 64];
    while bench.borrow().requests.len() < requests {
        let count = match line.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => 0,
            Err(_) => return,
        };
        let answer = model.exchange(&buffer[..count]).unwrap();
        if line.write_all(&answer).and_then(|()| line.flush()).is_err() {
            return;
        }
    }
}

/// A machine behind a socket, which hangs up after some requests; its address.
fn behind_a_socket(requests: usize) -> (String, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let server = thread::spawn(move || {
        let (stream, _) = listener.accept().unwrap();
        stream
            .set_read_timeout(Some(Duration::from_millis(1)))
            .unwrap();
        serve(stream, requests);
    });
    (address, server)
}

fn a_session(transport: impl Transport + 'static) {
    let mut client = Client::open(transport).unwrap();
    client.order(Body::Enable).unwrap();
    assert_eq!(client.status().unwrap().state, MachineState::Enabled);
    let before = client.now();
    client.wait(Duration::from_millis(20)).unwrap();
    assert!(client.now() - before >= Duration::from_millis(20));
    // Nobody presses the emergency stop of a machine that is not there.
    assert!(client.simulated_io().is_none());
}

#[test]
fn a_socket_carries_a_session() {
    let (address, server) = behind_a_socket(usize::MAX);
    a_session(TcpTransport::connect(&address).unwrap());
    server.join().unwrap();
}

#[test]
fn a_machine_that_hangs_up_is_reported_with_its_address() {
    let (address, server) = behind_a_socket(2);
    let mut client = Client::open(TcpTransport::connect(&address).unwrap()).unwrap();
    client.status().unwrap();
    server.join().unwrap();
    let error = client.status().unwrap_err().to_string();
    assert!(error.contains(&address), "{error}");
}

#[test]
fn one_program_at_a_time_talks_to_a_machine_and_another_learns_which() {
    let (address, server) = behind_a_socket(usize::MAX);
    let mut client = Client::open(TcpTransport::connect(&address).unwrap()).unwrap();
    // A lock is a file's: another opening of it stands for another program.
    let refused = TcpTransport::connect(&address).err().expect("held");
    assert_eq!(refused.kind(), std::io::ErrorKind::ResourceBusy);
    let said = refused.to_string();
    assert!(
        said.contains(&format!("process {}", std::process::id())),
        "{said}"
    );
    client.status().unwrap();
    drop(client);
    server.join().unwrap();
    // Given back: what fails now is that nobody listens.
    let after = TcpTransport::connect(&address).err().expect("no server");
    assert_ne!(after.kind(), std::io::ErrorKind::ResourceBusy);
}

#[cfg(unix)]
#[test]
fn a_serial_port_carries_a_session() {
    use serialport::{SerialPort, TTYPort};

    use crate::machine::SerialTransport;

    let (mut master, slave) = TTYPort::pair().unwrap();
    let path = slave.name().unwrap();
    // A port is opened by one program at a time.
    drop(slave);
    let transport = SerialTransport::open(&path).unwrap();
    master.set_timeout(Duration::from_millis(1)).unwrap();
    // Detached: it ends when the port is closed.
    thread::spawn(move || serve(master, usize::MAX));
    a_session(transport);
}
