//! A machine that one program holds, and others look at.

use std::time::Duration;

use quadrant::link::message::{AxisName, Body, MachineState};

use super::model::Model;
use crate::client::{Client, ClientError};
use crate::machine::{Loopback, Shared, TcpTransport};

/// Longest time in which a viewer is told what its holder knows.
const TOLD: Duration = Duration::from_secs(5);

#[test]
fn others_see_what_the_holder_hears_and_may_only_stop() {
    let (model, bench) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    // As many as like to.
    let mut viewers: Vec<Client> = (0..2)
        .map(|_| Client::open(TcpTransport::look(&address).unwrap()).unwrap())
        .collect();
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
    let told = viewers[1].notice(TOLD).unwrap();
    assert!(told.is_some(), "no event came");

    let before = bench.borrow().requests.len();
    viewers[1].order(Body::Stop).unwrap();
    viewers[0].order(Body::Disable).unwrap();
    assert_eq!(
        bench.borrow().requests.len(),
        before,
        "only the holder speaks"
    );
    holder.wait(Duration::from_millis(500)).unwrap();
    assert!(bench.borrow().requests[before..].contains(&"disable"));
    assert_eq!(holder.status().unwrap().state, MachineState::Disabled);
}

#[test]
fn a_viewer_that_leaves_disturbs_nobody() {
    let (model, _) = Model::new();
    let shared = Shared::listen(Loopback::new(model), "127.0.0.1:0").unwrap();
    let address = shared.address().to_string();
    let mut holder = Client::open(shared).unwrap();
    for _ in 0..3 {
        drop(Client::open(TcpTransport::look(&address).unwrap()).unwrap());
        holder.order(Body::Enable).unwrap();
        holder.wait(Duration::from_millis(300)).unwrap();
        holder.order(Body::Disable).unwrap();
    }
    let mut late = Client::open(TcpTransport::look(&address).unwrap()).unwrap();
    assert_eq!(late.status().unwrap().state, holder.status().unwrap().state);
}
