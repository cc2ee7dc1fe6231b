//! What the link's types say to people, and what they count.

use quadrant::link::frame::{DecodeError, EncodeError};
use quadrant::link::message::{
    AxisName, AxisSet, AxisSignal, Body, CaptureRequest, Channel, InjectRequest, Plan,
    SettingsRequest, StageSignal, StreamRequest, TelemetryRequest, Voltages, Words,
};

const RESOLUTION_MM: [f64; 3] = [1e-3, 2e-3, 5e-4];

fn open(values: [f64; 3]) -> InjectRequest {
    InjectRequest::Open {
        axis: AxisName::X,
        open_loop: true,
        with_plan: false,
        limit_v: values[0],
        travel_mm: values[1],
        max_velocity_mm_s: values[2],
    }
}

#[test]
fn requests_have_names_and_those_that_may_move_the_machine_are_known() {
    let moves = [
        (Body::Enable, "enable"),
        (Body::Home(AxisSet::ALL), "home"),
        (
            Body::Move {
                axis: AxisName::X,
                target_mm: 1.0,
                velocity_mm_s: 1.0,
            },
            "move",
        ),
        (
            Body::Jog {
                axis: AxisName::X,
                velocity_mm_s: 1.0,
            },
            "jog",
        ),
        (Body::Run, "run"),
        (Body::Stream(StreamRequest::Close), "stream"),
        (Body::Inject(InjectRequest::Close), "inject"),
    ];
    let does_not = [
        (Body::Hello, "hello"),
        (Body::Status, "status"),
        (Body::Fault, "fault"),
        (Body::ResetFault, "reset-fault"),
        (Body::Disable, "disable"),
        (Body::Stop, "stop"),
        (Body::SetPlan(Plan::default()), "set-plan"),
        (Body::Settings(SettingsRequest::Apply), "settings"),
        (Body::Telemetry(TelemetryRequest::Stop), "telemetry"),
        (Body::Capture(CaptureRequest::State), "capture"),
        (Body::Reboot, "reboot"),
        (Body::Inputs, "inputs"),
        (Body::Learning, "learning"),
        (Body::Spindle { rpm: 0.0 }, "spindle"),
    ];
    for (bodies, may_move) in [(&moves[..], true), (&does_not[..], false)] {
        for (body, name) in bodies {
            assert_eq!((body.name(), body.may_move()), (*name, may_move));
        }
    }
}

#[test]
fn a_number_that_is_none_goes_no_farther_than_the_link() {
    assert_eq!(Body::Inject(open([1.0; 3])).check(), Ok(()));
    for (place, field) in ["limit_v", "travel_mm", "max_velocity_mm_s"]
        .into_iter()
        .enumerate()
    {
        for (bad, kind) in [(f64::NAN, "NaN"), (f64::INFINITY, "infinite")] {
            let mut values = [1.0; 3];
            values[place] = bad;
            let said = format!("{:?}", Body::Inject(open(values)).check());
            assert!(said.contains(field) && said.contains(kind), "{said}");
        }
    }
}

#[test]
fn axes_are_named_and_a_set_takes_one_twice() {
    assert_eq!(AxisName::ALL.map(AxisName::as_str), ["x", "y", "z"]);
    let set = AxisSet::NONE.with(AxisName::Y).with(AxisName::Y);
    assert!(set.contains(AxisName::Y) && !set.contains(AxisName::X));
    let said = AxisSet::try_from(0x18).expect_err("no axes").to_string();
    assert!(said.contains("0x18"), "{said}");
}

#[test]
fn errors_say_what_does_not_fit() {
    assert!(EncodeError { room: 17 }.to_string().contains("17 bytes"));
    assert!(DecodeError::Version(9).to_string().contains("version 9"));
    assert!(DecodeError::Malformed.to_string().contains("not one of"));
    let unknown = "x.nothing".parse::<Channel>().expect_err("no channel");
    assert!(unknown.to_string().len() > 10, "{unknown}");
}

#[test]
fn channels_are_shown_in_the_units_that_people_read() {
    let of = |axis, signal| Channel::Axis(axis, signal);
    for (channel, unit, per_unit, shown) in [
        (
            of(AxisName::X, AxisSignal::Position),
            "mm",
            1e-3,
            ("mm", 1.0),
        ),
        (
            of(AxisName::Y, AxisSignal::Position),
            "mm",
            2e-3,
            ("mm", 1.0),
        ),
        (
            of(AxisName::Z, AxisSignal::Reference),
            "mm",
            5e-4 / 256.0,
            ("mm", 1.0),
        ),
        (of(AxisName::Z, AxisSignal::Error), "mm", 1.0, ("um", 1e3)),
        (of(AxisName::X, AxisSignal::Output), "V", 1.0, ("V", 1.0)),
        (of(AxisName::X, AxisSignal::Glitch), "um", 1.0, ("um", 1.0)),
        (
            Channel::Stage(StageSignal::CircleDeviation),
            "um",
            1.0,
            ("um", 1.0),
        ),
    ] {
        assert_eq!(channel.physical_unit(), unit, "{channel}");
        assert_eq!(channel.shown_unit(), shown, "{channel}");
        let physical = channel.physical(3.0, &RESOLUTION_MM);
        assert!((physical - 3.0 * per_unit).abs() < 1e-12, "{channel}");
    }
}

#[test]
fn blocks_count_what_they_hold() {
    let voltages = Voltages::new([7, -8, 9].into_iter());
    assert_eq!((voltages.len(), voltages.is_empty()), (3, false));
    assert!(Voltages::default().is_empty());
    let mut words = Words::new();
    assert!(words.is_empty() && words.extend([1, 2].into_iter()));
    assert_eq!((words.len(), words.is_empty()), (2, false));
}
