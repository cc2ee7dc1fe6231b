//! Oscillations that the law finds become events.

use quadrant::app::{Snapshot, Supervision};
use quadrant_law::axes::AxisName;
use quadrant_law::safety::oscillation::{OscillationKind, OscillationReading};
use quadrant_law::supervisor::{Event, Oscillated};

#[test]
fn what_is_found_becomes_an_event_once() {
    let mut snapshot = Snapshot::<f32>::default();
    snapshot.axes[0].oscillation = OscillationReading {
        number: 1,
        kind: OscillationKind::Hum,
        half_cycles: 1036,
        looks: 5002,
        looks_per_s: 2500,
        swings: 29_008,
    };
    let mut supervision = Supervision::new([5e-4; 3]);
    let mut reported = || {
        let events = supervision.run(&snapshot, None).events;
        let reported = events.into_iter().filter_map(|event| match event {
            Event::Oscillated(found) => Some(found),
            _ => None,
        });
        reported.collect::<Vec<_>>()
    };
    let found = Oscillated {
        axis: AxisName::X,
        kind: OscillationKind::Hum,
        decihertz: 2589,
        micrometres: 7,
    };
    assert_eq!(reported(), [found]);
    assert_eq!(reported(), []);
}
