//! The supervisor's events as notices of the link.

use quadrant::app::Translated;
use quadrant_law::safety::FaultCode;
use quadrant_law::supervisor;
use quadrant_link::message::{AxisName, Event};

#[test]
fn the_supervisors_events_have_their_notice() {
    let fault = quadrant_law::safety::Fault {
        code: FaultCode::EncoderJump,
        axis: Some(quadrant_law::axes::AxisName::Y),
        tick: 5,
    };
    let expected = Event::Fault {
        code: 2,
        axis: Some(AxisName::Y),
    };
    assert_eq!(
        Event::translated(supervisor::Event::Faulted(fault)),
        expected
    );
    let refused = supervisor::Event::Refused(
        quadrant_law::command::Command::Run,
        quadrant_law::admission::Refusal::NotEnabled,
    );
    let Event::Refused(text) = Event::translated(refused) else {
        panic!("a refusal");
    };
    assert_eq!(text, "the outputs are off; enable them first");
}

#[test]
fn the_texts_of_all_faults_fit_their_report() {
    for code in FaultCode::ALL {
        assert!(code.name().len() <= 32, "{code:?}");
        assert!(code.cause().len() <= 160, "{code:?}");
        assert!(code.remedy().len() <= 224, "{code:?}");
    }
}
