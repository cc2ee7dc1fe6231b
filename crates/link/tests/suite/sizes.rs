//! The room that the largest messages need.

use heapless::{String, Vec as Bounded};
use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::frame::{self, FRAME_BYTES, FrameCounters};
use quadrant_link::message::AxisName;
use quadrant_link::message::{
    AxisMode, AxisPoint, AxisSet, AxisStatus, Body, CaptureRequest, CaptureStatus, Event,
    FaultReport, INJECT_VALUES, Identity, InjectRequest, LinkError, Message, Notice, NumberType,
    PathPage, Reply, Request, Response, SetPoint, SettingsRequest, Status, StreamRequest,
    TelemetryRequest, Value, Voltages, WordPage,
};
use quadrant_link::message::{CaptureCause, CapturePhase, CaptureRecord, Edge, Level, Trigger};
use quadrant_link::message::{Channel, LimitedBy, MachineState, SampleWords, TelemetryBlock};
use quadrant_link::message::{Harmonic, Motion, Plan};
use quadrant_link::server::LinkServer;

use crate::model::there_and_back;

const HUGE: f64 = f64::MAX;

fn long<const N: usize>() -> String<N> {
    std::iter::repeat_n('~', N).collect()
}

fn long_value() -> Value {
    let mut bytes = Bounded::new();
    while bytes.push(u8::MAX).is_ok() {}
    Value {
        kind: u8::MAX,
        bytes,
    }
}

fn full_words() -> SampleWords {
    let mut words = SampleWords::new();
    assert!(words.extend([u32::MAX; 112].into_iter()));
    assert!(!words.extend([0].into_iter()), "112 words are all");
    words
}

fn channels() -> Bounded<Channel, 8> {
    Channel::all().take(8).collect()
}

/// The largest of every kind of request that holds more than a few numbers.
fn largest_requests() -> Vec<Body> {
    let harmonic = Motion::Harmonic(Harmonic {
        amplitude_mm: HUGE,
        frequency_hz: HUGE,
        phase_rad: HUGE,
        cycles: Some(HUGE),
        lead_s: HUGE,
    });
    let point = AxisPoint {
        position_mm: HUGE,
        velocity_mm_s: f32::MAX,
        acceleration_mm_s2: f32::MAX,
    };
    let mut points = Bounded::new();
    while points.push(SetPoint { axes: [point; 3] }).is_ok() {}
    vec![
        Body::SetPlan(Plan {
            motions: [harmonic; 3],
        }),
        Body::Stream(StreamRequest::Points {
            sequence: u32::MAX,
            points,
            last: true,
        }),
        Body::Settings(SettingsRequest::Set {
            path: long(),
            value: long_value(),
        }),
        Body::Settings(SettingsRequest::Store(long())),
        Body::Inject(InjectRequest::Values {
            sequence: u32::MAX,
            values: Voltages::new([i16::MIN; INJECT_VALUES].into_iter()),
            last: true,
        }),
        Body::Telemetry(TelemetryRequest::Select {
            channels: channels(),
            decimation: u16::MAX,
        }),
        Body::Capture(CaptureRequest::Arm {
            channels: channels(),
            decimation: u16::MAX,
            pre_trigger_percent: 100,
            trigger: Trigger::Level(Level {
                channel: Channel::all().last().expect("there are channels"),
                edge: Edge::Either,
                level: HUGE,
            }),
        }),
    ]
}

/// The largest of every kind of reply that holds more than a few numbers.
fn largest_replies() -> Vec<Reply> {
    let most = u32::MAX;
    let axis = AxisStatus {
        mode: AxisMode::Stopping,
        position_mm: HUGE,
        error_mm: f32::MAX,
        output_v: f32::MAX,
        limited_by: LimitedBy::OutputLimit,
        high_mark: f32::MAX,
    };
    let mut paths = Bounded::new();
    while paths.push(long()).is_ok() {}
    vec![
        Reply::Identity(Identity {
            protocol: PROTOCOL_VERSION,
            firmware: long(),
            board: long(),
            rate_hz: HUGE,
            cycle_hz: most,
            number: NumberType::F64,
            tick: most,
        }),
        Reply::Status(Status {
            tick: most,
            state: MachineState::Fault,
            fault: Some(255),
            running: true,
            homed: AxisSet::ALL,
            axes: [axis; 3],
            overruns: most,
            longest_tick_cycles: most,
            capture: CapturePhase::Frozen,
            frames: FrameCounters {
                good: most,
                damaged: most,
                overlong: most,
                undecodable: most,
            },
            dropped_samples: most,
            dropped_events: most,
        }),
        Reply::Fault(Some(FaultReport {
            code: 255,
            axis: Some(AxisName::Z),
            tick: most,
            name: long(),
            cause: long(),
            remedy: long(),
            captured: true,
        })),
        Reply::Value(long_value()),
        Reply::Paths(PathPage {
            paths,
            next: Some(u16::MAX),
        }),
        Reply::Provenance(long()),
        Reply::Capture(CaptureStatus {
            phase: CapturePhase::Frozen,
            number: u16::MAX,
            channels: channels(),
            decimation: u16::MAX,
            record: Some(CaptureRecord {
                samples: most,
                trigger_sample: most,
                first_tick: most,
                trigger_tick: most,
                cause: CaptureCause::MotionStart,
            }),
        }),
        Reply::Words(WordPage {
            number: u16::MAX,
            offset: u16::MAX,
            words: full_words(),
        }),
    ]
}

/// The largest of every kind of notice.
fn largest_notices() -> Vec<Notice> {
    vec![
        Notice::Event {
            sequence: u16::MAX,
            tick: u32::MAX,
            event: Event::Refused(long()),
        },
        Notice::Telemetry(TelemetryBlock {
            generation: 255,
            sequence: u32::MAX,
            tick: u32::MAX,
            dropped: u32::MAX,
            channels: 8,
            words: full_words(),
        }),
        Notice::Log(long()),
    ]
}

#[test]
fn the_largest_messages_fit_a_frame_and_survive_the_way() {
    for body in largest_requests() {
        body.check().expect("finite");
        let request = Request { id: u16::MAX, body };
        assert_eq!(there_and_back(&request), request);
    }
    let refused = LinkError::Invalid(long());
    let results = largest_replies().into_iter().map(Ok);
    for result in results.chain([Err(refused)]) {
        let message = Message::Response(Response {
            id: u16::MAX,
            result,
        });
        assert_eq!(there_and_back(&message), message);
    }
    for notice in largest_notices() {
        let message = Message::Notice(notice);
        assert_eq!(there_and_back(&message), message);
    }
}

#[test]
fn what_a_message_holds_in_memory_is_bounded() {
    assert!(size_of::<Request>() <= 480, "{}", size_of::<Request>());
    assert!(size_of::<Message>() <= 512, "{}", size_of::<Message>());
    assert!(
        size_of::<LinkServer>() <= 560,
        "{}",
        size_of::<LinkServer>()
    );
}

#[test]
fn a_full_block_of_telemetry_takes_what_the_documentation_says() {
    let mut buffer = [0; FRAME_BYTES];
    let block = Message::Notice(largest_notices().remove(1));
    assert_eq!(frame::encode(&block, &mut buffer).map(<[u8]>::len), Ok(477));
}
