//! The link of a component that ticks.

use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use quadrant_host::client::Client;
use quadrant_host::machine::TcpTransport;

use crate::component::{Component, Parameters};

/// A port that is free.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port()
}

#[test]
fn a_host_talks_to_the_component_while_it_ticks() {
    let port = free_port();
    let ends = Arc::new(AtomicBool::new(false));
    let ended = Arc::clone(&ends);
    let (ready, is_ready) = std::sync::mpsc::channel();
    let ticking = thread::spawn(move || {
        let mut component = Component::start(&Parameters {
            port: port.into(),
            ..Parameters::default()
        });
        ready.send(()).unwrap();
        while !ended.load(Ordering::Relaxed) {
            component.step(false);
            thread::sleep(Duration::from_micros(200));
        }
    });
    is_ready.recv().unwrap();
    let transport = TcpTransport::connect(&format!("127.0.0.1:{port}")).unwrap();
    let client = Client::open(transport).unwrap();
    let identity = format!("{:?}", client.identity());
    assert!(identity.contains("linuxcnc"), "{identity}");
    ends.store(true, Ordering::Relaxed);
    ticking.join().unwrap();
}

#[test]
fn a_client_that_floods_changes_no_output() {
    let port = free_port();
    let mut quiet = Component::start(&Parameters::default());
    let mut flooded = Component::start(&Parameters {
        port: port.into(),
        ..Parameters::default()
    });
    let mut client = TcpStream::connect(("127.0.0.1", port)).unwrap();
    client.set_nonblocking(true).unwrap();
    let rubbish: Vec<u8> = (0..65_536_u32)
        .map(|index| (index.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let mut sent = 0;
    for tick in 0..20_000 {
        sent += client.write(&rubbish).unwrap_or(0);
        quiet.step(tick > 10);
        flooded.step(tick > 10);
        assert_eq!(quiet.outputs(), flooded.outputs(), "{tick}");
    }
    assert!(sent > 100_000, "{sent}");
    assert!(flooded.pins.driven);
}
