//! The holding brake, as a host sees it.

use quadrant_fault_bench::tasks::Tasks;
use quadrant_link::message::{AxisName as WireAxis, Body, LinkError, Provenance, SettingsRequest};

use crate::preemption;

#[test]
fn a_host_that_asks_while_the_brake_moves_has_to_ask_again() {
    let mut settings = preemption::settings();
    (settings.brake.release_s, settings.brake.apply_s) = (0.1, 0.1);
    let mut tasks = Tasks::new(&settings, 1);
    let busy = |answer: &Result<_, LinkError>| matches!(answer, Err(LinkError::Busy(_)));
    let jog = Body::Jog {
        axis: WireAxis::Y,
        velocity_mm_s: 1.0,
    };
    let store = Body::Settings(SettingsRequest::Store(Provenance::new()));
    tasks.ask(Body::Enable).expect("enables");
    assert!(busy(&tasks.ask(jog.clone())));
    assert!(tasks.ask(Body::Status).is_ok());
    tasks.run(1100);
    tasks.ask(jog).expect("the brake is released");
    tasks.ask(Body::Stop).expect("stops");
    tasks.run(2000);
    tasks.ask(Body::Disable).expect("disables");
    tasks.run(20);
    assert!(busy(&tasks.ask(store.clone())));
    assert!(busy(&tasks.ask(Body::Enable)));
    assert!(tasks.upper.borrow().outputs.enabled);
    tasks.run(1100);
    assert!(!tasks.upper.borrow().outputs.enabled);
    tasks.ask(store).expect("stores");
}
