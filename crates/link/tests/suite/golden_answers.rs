//! The wire format of what a server sends, byte for byte.

use heapless::Vec as Bounded;
use quadrant_link::frame::FrameCounters;
use quadrant_link::message::AxisName::{Y, Z};
use quadrant_link::message::*;
use quadrant_link::message::{CaptureCause, CapturePhase, CaptureRecord};
use quadrant_link::message::{LimitedBy, MachineState, SampleWords, TelemetryBlock};

use crate::golden::{channels, flag, hex, short};

fn words() -> SampleWords {
    let mut words = SampleWords::new();
    assert!(words.extend([1, 0x0203_0405].into_iter()));
    words
}

fn replies() -> Vec<(Result<Reply, LinkError>, &'static str)> {
    let axis = AxisStatus {
        mode: AxisMode::Jog,
        position_mm: 1.0,
        error_mm: 2.0,
        output_v: -2.0,
        limited_by: LimitedBy::OutputLimit,
        high_mark: 0.5,
    };
    let status = Status {
        tick: 300,
        state: MachineState::Enabled,
        fault: None,
        running: true,
        homed: AxisSet::ALL,
        axes: [axis; 3],
        overruns: 1,
        longest_tick_cycles: 2,
        capture: CapturePhase::Armed,
        frames: FrameCounters {
            good: 3,
            damaged: 4,
            overlong: 5,
            undecodable: 6,
        },
        dropped_samples: 7,
        dropped_events: 8,
    };
    let fault = FaultReport {
        code: 2,
        axis: Some(Z),
        tick: 300,
        name: short("n"),
        cause: short("c"),
        remedy: short("r"),
        captured: true,
    };
    let identity = Identity {
        protocol: 1,
        firmware: short("0.1.0"),
        board: short("b"),
        rate_hz: 1.0,
        cycle_hz: 128,
        number: NumberType::Fixed,
        tick: 5,
    };
    let capture = CaptureStatus {
        phase: CapturePhase::Frozen,
        number: 9,
        channels: channels(),
        decimation: 1,
        record: Some(CaptureRecord {
            samples: 4,
            trigger_sample: 2,
            first_tick: 300,
            trigger_tick: 302,
            cause: CaptureCause::Level,
        }),
    };
    vec![
        (Ok(Reply::Done), "00"),
        (
            Ok(Reply::Identity(identity)),
            "010105302e312e300162000000000000f03f80010105",
        ),
        (
            Ok(Reply::Status(status)),
            "02ac0203000107\
             02000000000000f03f00000040000000c0010000003f\
             02000000000000f03f00000040000000c0010000003f\
             02000000000000f03f00000040000000c0010000003f\
             0102010304050607\
             08",
        ),
        (Ok(Reply::Fault(None)), "0300"),
        (
            Ok(Reply::Fault(Some(fault))),
            "0301020102ac02016e0163017201",
        ),
        (
            Ok(Reply::Stream(StreamStatus {
                next_sequence: 300,
                free: 24,
            })),
            "04ac0218",
        ),
        (Ok(Reply::Value(flag())), "05020101"),
        (
            Ok(Reply::Paths(PathPage {
                paths: Bounded::from_slice(&[short("/a"), short("/b")]).expect("two"),
                next: Some(2),
            })),
            "0602022f61022f620102",
        ),
        (
            Ok(Reply::Applied(Applied {
                changed: AxisSet::ALL,
                restart_needed: true,
            })),
            "070701",
        ),
        (Ok(Reply::Provenance(short("me"))), "08026d65"),
        (Ok(Reply::Telemetry { generation: 3 }), "0903"),
        (
            Ok(Reply::Capture(capture)),
            "0a030903024d62010104\
             02ac02ae0204",
        ),
        (
            Ok(Reply::Words(WordPage {
                number: 9,
                offset: 112,
                words: words(),
            })),
            "0b0970080100000005040302",
        ),
        (
            Ok(Reply::Inject(InjectStatus {
                next_sequence: 300,
                free: 1440,
                first_tick: Some(128),
                done: 7,
                ended: true,
            })),
            "0cac02a00b0180010701",
        ),
        (
            Ok(Reply::Inputs(Inputs {
                tick: 300,
                switches: 0x8001,
                indexed: AxisSet::ALL,
                refusal: Some(short("r")),
            })),
            "0dac02818002070101\
             72",
        ),
        (
            Ok(Reply::Learning(Learning {
                tick: 300,
                axes: [
                    Some(AxisLearning {
                        state: LearningState::Fading,
                        scale: 1.5,
                        gate: 1.0,
                        error_share: Some(0.25),
                    }),
                    None,
                    None,
                ],
            })),
            "0eac0201050000c03f\
             0000803f010000803e0000",
        ),
        (
            Ok(Reply::Log(LogPage {
                from: 300,
                bytes: heapless::Vec::from_slice(&[7, 0]).unwrap(),
            })),
            "0fac02020700",
        ),
        (Err(LinkError::Version { yours: 9, mine: 1 }), "000901"),
        (Err(LinkError::Undecodable), "01"),
        (Err(LinkError::NoHello), "02"),
        (Err(LinkError::Unsupported(short("u"))), "030175"),
        (Err(LinkError::Busy(short("b"))), "040162"),
        (Err(LinkError::Refused(short("r"))), "050172"),
        (Err(LinkError::Invalid(short("i"))), "060169"),
        (Err(LinkError::Storage(short("s"))), "070173"),
    ]
}

fn notices() -> Vec<(Notice, &'static str)> {
    let event = |event| Notice::Event {
        sequence: 1,
        tick: 300,
        event,
    };
    vec![
        (event(Event::Started(short("s"))), "0001ac02000173"),
        (event(Event::Enabled), "0001ac0201"),
        (event(Event::Disabled), "0001ac0202"),
        (
            event(Event::Fault {
                code: 3,
                axis: None,
            }),
            "0001ac02030300",
        ),
        (
            event(Event::Stopping {
                code: 8,
                axis: Some(Y),
            }),
            "0001ac0204080101",
        ),
        (
            event(Event::Held {
                code: 17,
                axis: None,
            }),
            "0001ac02051100",
        ),
        (event(Event::MotionStarted), "0001ac0206"),
        (event(Event::MotionFinished), "0001ac0207"),
        (event(Event::Refused(short("r"))), "0001ac02080172"),
        (event(Event::Homed(Y)), "0001ac020901"),
        (event(Event::CaptureFrozen { number: 9 }), "0001ac020a09"),
        (event(Event::SettingsApplied(AxisSet::ALL)), "0001ac020b07"),
        (event(Event::SettingsStored), "0001ac020c"),
        (event(Event::MovedWhileOff(Y)), "0001ac020d01"),
        (
            event(Event::FrictionChanged {
                axis: Y,
                percent: 160,
                needs_maintenance: true,
            }),
            "0001ac020e01a00101",
        ),
        (
            event(Event::Oscillated {
                axis: Y,
                kind: OscillationKind::Added,
                decihertz: 2590,
                micrometres: 3,
            }),
            "0001ac020f01019e1403",
        ),
        (
            Notice::Telemetry(TelemetryBlock {
                generation: 2,
                sequence: 128,
                tick: 300,
                dropped: 1,
                channels: 2,
                words: words(),
            }),
            "01028001ac020102080100000005040302",
        ),
        (Notice::Log(short("l")), "02016c"),
    ]
}

#[test]
fn responses_have_their_golden_bytes() {
    for (result, golden) in replies() {
        let tag = if result.is_ok() { "00" } else { "01" };
        let message = Message::Response(Response { id: 300, result });
        assert_eq!(hex(&message), format!("00ac02{tag}{golden}"), "{message:?}");
    }
}

#[test]
fn notices_have_their_golden_bytes() {
    for (notice, golden) in notices() {
        let message = Message::Notice(notice);
        assert_eq!(hex(&message), format!("01{golden}"), "{message:?}");
    }
}
