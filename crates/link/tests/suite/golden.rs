//! The wire format, byte for byte: a change of it is a change of the protocol's version.

use heapless::Vec as Bounded;
use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::message::AxisName::{X, Y, Z};
use quadrant_link::message::Channel;
use quadrant_link::message::*;
use quadrant_link::message::{Edge, Level, Trigger};

use quadrant_test_support::traffic::framed;

/// The bytes of a message, in hexadecimal, without version and frame.
pub(crate) fn hex<T: serde::Serialize>(message: &T) -> String {
    let mut buffer = [0; 512];
    let used = postcard::to_slice(message, &mut buffer).expect("fits");
    used.iter().map(|byte| format!("{byte:02x}")).collect()
}

pub(crate) fn short<const N: usize>(text: &str) -> heapless::String<N> {
    text.try_into().expect("short enough")
}

/// A flag that is set.
pub(crate) fn flag() -> Value {
    Value {
        kind: 2,
        bytes: Bounded::from_slice(&[1]).expect("one byte"),
    }
}

pub(crate) fn channels() -> Bounded<Channel, 8> {
    ["x.error", "z.code", "stage.tick"]
        .iter()
        .map(|name| name.parse().expect("a channel"))
        .collect()
}

fn requests() -> Vec<(Body, &'static str)> {
    let settings = Body::Settings;
    let capture = Body::Capture;
    let arm = |trigger| {
        capture(CaptureRequest::Arm {
            channels: channels(),
            decimation: 300,
            pre_trigger_percent: 50,
            trigger,
        })
    };
    let point = SetPoint {
        axes: [1.0, -1.0, 0.5].map(|value| AxisPoint {
            position_mm: value,
            velocity_mm_s: 2.0,
            acceleration_mm_s2: -2.0,
        }),
    };
    vec![
        (Body::Hello, "00"),
        (Body::Status, "01"),
        (Body::Fault, "02"),
        (Body::Inputs, "12"),
        (Body::Learning, "13"),
        (Body::Spindle { rpm: 3000.0 }, "14000000000070a740"),
        (Body::Log { from: 300 }, "15ac02"),
        (Body::ResetFault, "03"),
        (Body::Enable, "04"),
        (Body::Disable, "05"),
        (Body::Stop, "06"),
        (Body::Home(AxisSet::NONE.with(X).with(Z)), "0705"),
        (
            Body::Move {
                axis: Y,
                target_mm: 1.0,
                velocity_mm_s: -2.0,
            },
            "0801000000000000f03f00000000000000c0",
        ),
        (
            Body::Jog {
                axis: Z,
                velocity_mm_s: 0.5,
            },
            "0902000000000000e03f",
        ),
        (Body::Run, "0a"),
        (
            Body::SetPlan(Plan {
                motions: [
                    Motion::Hold,
                    Motion::Harmonic(Harmonic {
                        amplitude_mm: 1.0,
                        frequency_hz: 2.0,
                        phase_rad: 0.0,
                        cycles: Some(1.0),
                        lead_s: 0.5,
                    }),
                    Motion::PointToPoint(PointToPoint {
                        distance_mm: 1.0,
                        max_velocity_mm_s: 2.0,
                        max_acceleration_mm_s2: 0.5,
                        max_jerk_mm_s3: 1.0,
                    }),
                ],
            }),
            "0b00\
             01000000000000f03f0000000000000040000000000000000001000000000000f03f000000000000e03f\
             02000000000000f03f0000000000000040000000000000e03f000000000000f03f",
        ),
        (
            Body::Stream(StreamRequest::Open { period_ticks: 300 }),
            "0c00ac02",
        ),
        (
            Body::Stream(StreamRequest::Points {
                sequence: 128,
                points: Bounded::from_slice(&[point]).expect("one"),
                last: true,
            }),
            "0c01800101\
             000000000000f03f00000040000000c0\
             000000000000f0bf00000040000000c0\
             000000000000e03f00000040000000c0\
             01",
        ),
        (Body::Stream(StreamRequest::Close), "0c02"),
        (settings(SettingsRequest::Get(short("/a"))), "0d00022f61"),
        (
            settings(SettingsRequest::Set {
                path: short("/a"),
                value: flag(),
            }),
            "0d01022f61020101",
        ),
        (settings(SettingsRequest::List { cursor: 200 }), "0d02c801"),
        (settings(SettingsRequest::Apply), "0d03"),
        (settings(SettingsRequest::Revert), "0d04"),
        (settings(SettingsRequest::Defaults), "0d05"),
        (settings(SettingsRequest::Store(short("me"))), "0d06026d65"),
        (settings(SettingsRequest::Provenance), "0d07"),
        (
            settings(SettingsRequest::Edited { cursor: 200 }),
            "0d08c801",
        ),
        (
            settings(SettingsRequest::GetInForce(short("/a"))),
            "0d09022f61",
        ),
        (
            Body::Telemetry(TelemetryRequest::Select {
                channels: channels(),
                decimation: 10,
            }),
            "0e0003024d620a",
        ),
        (Body::Telemetry(TelemetryRequest::Stop), "0e01"),
        (arm(Trigger::Now), "0f0003024d62ac023200"),
        (arm(Trigger::Command), "0f0003024d62ac023201"),
        (arm(Trigger::Fault), "0f0003024d62ac023202"),
        (
            arm(Trigger::Level(Level {
                channel: Channel::try_from(2).expect("x.error"),
                edge: Edge::Falling,
                level: 1.0,
            })),
            "0f0003024d62ac0232030201000000000000f03f",
        ),
        (arm(Trigger::MotionStart), "0f0003024d62ac023204"),
        (capture(CaptureRequest::Disarm), "0f01"),
        (capture(CaptureRequest::State), "0f02"),
        (capture(CaptureRequest::Read { offset: 112 }), "0f0370"),
        (Body::Reboot, "10"),
        (
            Body::Inject(InjectRequest::Open {
                axis: Y,
                open_loop: true,
                with_plan: false,
                limit_v: 1.0,
                travel_mm: 2.0,
                max_velocity_mm_s: 0.5,
            }),
            "1100010100000000000000f03f0000000000000040000000000000e03f",
        ),
        (
            Body::Inject(InjectRequest::Values {
                sequence: 128,
                values: Voltages::new([1, -2, 300].into_iter()),
                last: true,
            }),
            "11018001060100feff2c0101",
        ),
        (Body::Inject(InjectRequest::Close), "1102"),
    ]
}

#[test]
fn requests_have_their_golden_bytes() {
    for (body, golden) in requests() {
        let request = Request { id: 300, body };
        assert_eq!(hex(&request), format!("ac02{golden}"), "{request:?}");
    }
}

#[test]
fn channels_have_their_golden_numbers() {
    let table: Vec<String> = Channel::all()
        .map(|channel| format!("{}={channel}[{}]", u8::from(channel), channel.unit()))
        .collect();
    let signals = |first: u8, axis: &str| {
        [
            "reference[count/256]",
            "position[count]",
            "error[mm]",
            "velocity[mm/s]",
            "p[V]",
            "i[V]",
            "d[V]",
            "level[V]",
            "viscous[V]",
            "presliding[V]",
            "inertia[V]",
            "transfer[V]",
            "output[V]",
            "code[]",
            "limited-by[]",
            "injection[V]",
            "code-sum[]",
            "glitch[um]",
            "friction-scale[]",
            "learning[]",
            "vibration-gate[]",
            "error-squares[]",
            "error-squares-off[]",
        ]
        .iter()
        .zip(first..)
        .map(|(signal, number)| format!("{number}={axis}.{signal}"))
        .collect::<Vec<_>>()
    };
    let stage = [
        "96=stage.state[]",
        "97=stage.fault[]",
        "98=stage.tick[tick]",
        "99=stage.elapsed[cycle]",
        "100=stage.circle-deviation[um]",
        "101=stage.circle-angle[deg]",
    ];
    let golden = [
        signals(0, "x"),
        signals(32, "y"),
        signals(64, "z"),
        stage.map(String::from).to_vec(),
    ]
    .concat();
    assert_eq!(table, golden);
}

/// The example of docs/link.md is what the code sends.
#[test]
fn the_dump_in_the_documentation_is_what_is_sent() {
    let page = include_str!("../../../../docs/link.md");
    let dumps: Vec<Vec<u8>> = page
        .lines()
        .filter_map(|line| line.strip_prefix("    frame: "))
        .map(|line| {
            let bytes = line.split_whitespace();
            bytes
                .map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal"))
                .collect()
        })
        .collect();
    let request = framed(&Request {
        id: 300,
        body: Body::Jog {
            axis: Z,
            velocity_mm_s: 0.5,
        },
    });
    let mut buffer = [0; 512];
    let answer = Message::Response(Response {
        id: 300,
        result: Err(LinkError::Version { yours: 9, mine: 1 }),
    });
    let answer = quadrant_link::frame::encode(&answer, &mut buffer).expect("fits");
    assert_eq!(dumps, [request, answer.to_vec()]);
    assert!(page.contains(&format!("version **{PROTOCOL_VERSION}**")));
}
