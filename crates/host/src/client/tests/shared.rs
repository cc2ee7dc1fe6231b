//! A machine that one program holds, and others look at.

use std::thread;
use std::time::{Duration, Instant};

use quadrant_link::message::{AxisName, Body, MachineState};

use super::model::Model;
use crate::client::{Client, ClientError};
use crate::machine::{Loopback, MOST_VIEWERS, Shared, TcpTransport};

/// Longest time in which a viewer receives what its holder knows.
const NOTICE_TIME: Duration = Duration::from_secs(5);

fn look(address: &str) -> Client {
    Client::open(TcpTransport::look(address, None).unwrap()).unwrap()
}

/// The answer that a viewer gets for an order, while the holder does something.
fn order(
    address: &str,
    body: Body,
    mut meanwhile: impl FnMut(),
) -> (Result<(), ClientError>, Duration) {
    let address = address.to_owned();
    let viewer = thread::spawn(move || {
        let mut viewer = look(&address);
        let began = Instant::now();
        (viewer.order(body), began.elapsed())
    });
    while !viewer.is_finished() {
        meanwhile();
        thread::sleep(Duration::from_millis(1));
    }
    viewer.join().unwrap()
}

#[test]
fn others_see_what_the_holder_receives_and_may_only_stop() {
    let (model, bench) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    // As many as like to.
    let mut viewers: Vec<Client> = (0..2).map(|_| look(&address)).collect();
    for viewer in &mut viewers {
        assert_eq!(viewer.identity(), holder.identity());
        assert_eq!(viewer.status().unwrap().state, MachineState::Disabled);
        assert_eq!(viewer.fault().unwrap(), None);
        for body in [Body::Enable, Body::Run, Body::Reboot, Body::ResetFault] {
            let refused = viewer.order(body.clone()).unwrap_err();
            assert!(matches!(refused, ClientError::Refused { .. }), "{refused}");
            assert!(
                refused.to_string().contains("holds the machine"),
                "{refused}"
            );
        }
    }
    assert!(!bench.borrow().requests.contains(&"enable"));

    holder.order(Body::Enable).unwrap();
    holder.wait(Duration::from_millis(500)).unwrap();
    assert_eq!(viewers[0].status().unwrap().state, MachineState::Enabled);
    holder
        .order(Body::Move {
            axis: AxisName::X,
            target_mm: 1.0,
            velocity_mm_s: 10.0,
        })
        .unwrap();
    holder.wait(Duration::from_millis(500)).unwrap();
    let notice = viewers[1].notice(NOTICE_TIME).unwrap();
    assert!(notice.is_some(), "no event came");

    for body in [Body::Stop, Body::Disable] {
        let name = body.name();
        let before = bench.borrow().requests.len();
        let (done, _) = order(&address, body, || holder.keep_alive().unwrap());
        done.unwrap();
        assert!(bench.borrow().requests[before..].contains(&name));
    }
    assert_eq!(holder.status().unwrap().state, MachineState::Disabled);
}

#[test]
fn a_viewer_whose_holder_is_busy_learns_that_nothing_was_done_and_nothing_is_done_later() {
    let (model, bench) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    holder.order(Body::Enable).unwrap();
    let (refused, took) = order(&address, Body::Disable, || {});
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("not done"), "{refused}");
    assert!(took < Duration::from_secs(1), "{took:?}");
    holder.wait(Duration::from_millis(500)).unwrap();
    assert!(!bench.borrow().requests.contains(&"disable"));

    // The machine has it, and is silent.
    bench.borrow_mut().lose_answers = 1000;
    let (unsure, _) = order(&address, Body::Disable, || {
        let _ = holder.keep_alive();
    });
    bench.borrow_mut().lose_answers = 0;
    let unsure = unsure.unwrap_err().to_string();
    assert!(unsure.contains("perhaps not done"), "{unsure}");
}

#[test]
fn what_is_not_fresh_is_no_state_of_now_and_says_its_age() {
    let (model, _) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    holder.order(Body::Enable).unwrap();
    holder.wait(Duration::from_millis(500)).unwrap();
    let mut viewer = look(&address);
    assert_eq!(viewer.status().unwrap().state, MachineState::Enabled);
    thread::sleep(Duration::from_millis(1100));
    let old = viewer.status().unwrap_err().to_string();
    // The client asks again for two seconds.
    let age = old.split(" s ago").next().unwrap();
    let age: f64 = age.rsplit(' ').next().unwrap().parse().unwrap();
    assert!((2.0..10.0).contains(&age), "{old}");
    assert!(old.contains("it was enabled, at rest, x 0.000 mm"), "{old}");
    for error in [viewer.inputs().err(), viewer.fault().err()] {
        let error = error.unwrap().to_string();
        assert!(error.contains(" s ago"), "{error}");
    }
}

#[test]
fn all_that_others_see_is_fresh_whatever_the_holder_asks_for() {
    let (model, _) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    let mut viewer = look(&address);
    let began = Instant::now();
    while began.elapsed() < Duration::from_millis(1500) {
        holder.status().unwrap();
        holder.wait(Duration::from_millis(10)).unwrap();
        thread::sleep(Duration::from_millis(10));
    }
    viewer.inputs().unwrap();
    viewer.learning().unwrap();
    viewer.fault().unwrap();
}

#[test]
fn a_viewer_that_leaves_disturbs_nobody() {
    let (model, _) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    // More than there may be at a time.
    for _ in 0..2 * MOST_VIEWERS {
        drop(look(&address));
        holder.order(Body::Enable).unwrap();
        holder.wait(Duration::from_millis(300)).unwrap();
        holder.order(Body::Disable).unwrap();
        thread::sleep(Duration::from_millis(30));
    }
    let state = holder.status().unwrap().state;
    assert_eq!(look(&address).status().unwrap().state, state);
}

#[test]
fn a_viewer_that_waits_stays_and_one_that_is_silent_is_gone() {
    let (model, _) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    let (mut waits, mut silent) = (look(&address), look(&address));
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(11) {
        holder.keep_alive().unwrap();
        // As at a prompt.
        waits.keep_alive().unwrap();
        thread::sleep(Duration::from_millis(50));
    }
    waits.status().unwrap();
    let gone = silent.status().unwrap_err();
    assert!(matches!(gone, ClientError::Connection { .. }), "{gone}");
}
