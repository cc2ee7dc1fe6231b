//! The words of the link's types for people, and their counts.

use quadrant_fault_bench::tasks::Tasks;
use quadrant_link::frame::{DecodeError, EncodeError};
use quadrant_link::message::{
    AxisName, AxisSet, AxisSignal, BLOCK_WORDS, Body, CaptureRequest, Channel, Event,
    InjectRequest, LearningState, MachineState, OscillationKind, Plan, Reply, SampleWords,
    SettingsRequest, StageSignal, Status, StreamRequest, TelemetryBlock, TelemetryRequest,
    Voltages, text,
};

use crate::preemption::settings;

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
            let said = format!("{:?}", Body::Spindle { rpm: bad }.check());
            assert!(said.contains("rpm") && said.contains(kind), "{said}");
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
    let mut words = SampleWords::new();
    assert!(words.is_empty() && words.extend([1, 2].into_iter()));
    assert_eq!((words.len(), words.is_empty()), (2, false));
}

#[test]
fn a_machine_is_driven_while_it_homes_works_and_brakes_and_rests_between() {
    let mut tasks = Tasks::new(&settings(), 1);
    let Ok(Reply::Status(seen)) = tasks.ask(Body::Status) else {
        panic!("is there");
    };
    for (state, name, drives) in [
        (MachineState::Start, "start", false),
        (MachineState::Disabled, "disabled", false),
        (MachineState::Homing, "homing", true),
        (MachineState::Enabled, "enabled", true),
        (MachineState::Fault, "fault", false),
        (MachineState::Stopping, "stopping", true),
    ] {
        assert_eq!((state.as_str(), state.drives()), (name, drives));
        for running in [false, true] {
            let status = Status {
                state,
                running,
                ..seen.clone()
            };
            let rests = !running && state != MachineState::Homing;
            assert_eq!(status.is_at_rest(), rests, "{state:?} {running}");
        }
    }
}

#[test]
fn events_and_states_of_learning_are_reported_in_words() {
    let friction = |percent, needs_maintenance| Event::FrictionChanged {
        axis: AxisName::X,
        percent,
        needs_maintenance,
    };
    let oscillated = |kind, decihertz| Event::Oscillated {
        axis: AxisName::X,
        kind,
        decihertz,
        micrometres: 344,
    };
    for (event, said) in [
        (Event::Enabled, "outputs on"),
        (
            oscillated(OscillationKind::Hum, 2590),
            "x hums at rest, 344 um at 259.0 Hz: lower the gains, or look for what shakes it",
        ),
        (
            oscillated(OscillationKind::Added, 16),
            "the feedforward of x made it swing, 344 um at 1.6 Hz, and is taken away for a while: check feedforward.kind and its gains",
        ),
        (
            oscillated(OscillationKind::AddedForGood, 16),
            "the feedforward of x made it swing, 344 um at 1.6 Hz, and is off until the outputs are off: check feedforward.kind and its gains",
        ),
        (
            Event::Fault {
                code: 7,
                axis: Some(AxisName::Y),
            },
            "fault 7 of y",
        ),
        (
            Event::Stopping {
                code: 9,
                axis: None,
            },
            "braking for fault 9",
        ),
        (
            friction(118, false),
            "friction of x is 1.18 times what was commissioned",
        ),
        (
            friction(205, true),
            "friction of x is 2.05 times what was commissioned: look after guide, drive and lubrication",
        ),
    ] {
        assert_eq!(event.to_string(), said);
    }
    assert_eq!(LearningState::Learning.words(), "learning");
    assert_eq!(LearningState::AtRest.words(), "frozen: at rest");
}

#[test]
fn a_text_that_is_too_long_ends_between_two_characters() {
    assert_eq!(text::<8>(format_args!("{} {}", 12, "ab")).as_str(), "12 ab");
    assert_eq!(text::<8>(format_args!("1234567{}", 8)).as_str(), "12345678");
    // In two parts: literals would be one.
    let [first, second] = ["12345", "6789"].map(String::from);
    assert_eq!(
        text::<8>(format_args!("{first}{second}")).as_str(),
        "12345678"
    );
    // Two bytes a character.
    assert_eq!(text::<8>(format_args!("12äöü{}", "x")).as_str(), "12äöü");
    assert_eq!(text::<8>(format_args!("123äöü{}", "x")).as_str(), "123äö");
}

#[test]
fn a_block_gives_its_samples_with_their_numbers_and_takes_no_more_than_fit() {
    let mut words = SampleWords::new();
    assert!(words.extend(1..8));
    let block = TelemetryBlock {
        sequence: 40,
        channels: 3,
        words: words.clone(),
        ..TelemetryBlock::default()
    };
    let samples: Vec<(u32, Vec<u32>)> = block
        .samples()
        .map(|(number, words)| (number, words.collect()))
        .collect();
    assert_eq!(samples, [(40, vec![1, 2, 3]), (41, vec![4, 5, 6])]);
    let room = BLOCK_WORDS - words.len();
    assert!(!words.extend(0..room as u32 + 1) && words.len() == 7);
    assert!(words.extend(0..room as u32) && words.len() == BLOCK_WORDS);
}
