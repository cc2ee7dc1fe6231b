//! Frames, and the port's manners.

use heapless::Vec as Bounded;
use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::frame::{
    self, DecodeError, EncodeError, FRAME_BYTES, FrameCounters, PAYLOAD_BYTES, Receiver,
};
use quadrant_link::message::AxisName;
use quadrant_link::message::{
    AxisPoint, AxisSet, Body, LinkError, Reply, Request, Response, SetPoint, StreamRequest, text,
};
use quadrant_link::server::LinkServer;

use quadrant_test_support::traffic::framed;

#[test]
fn a_buffer_that_is_too_small_is_an_error_at_every_size() {
    let request = Request {
        id: 1,
        body: Body::Stream(StreamRequest::Points {
            sequence: 0,
            points: Bounded::from_slice(&[SetPoint::default(); 8]).expect("eight"),
            last: false,
        }),
    };
    let length = framed(&request).len();
    for room in 0..length {
        let mut buffer = vec![0; room];
        assert_eq!(
            frame::encode(&request, &mut buffer),
            Err(EncodeError { room })
        );
    }
    assert!(frame::encode(&request, &mut vec![0; length]).is_ok());
}

#[test]
fn no_frame_is_larger_than_the_largest_however_large_the_buffer() {
    let mut buffer = [0; 4 * FRAME_BYTES];
    let payload = |length: usize| vec![0x55u8; length];
    // The version's byte and the two of the length are not the bytes themselves.
    let largest = PAYLOAD_BYTES - 3;
    let frame = frame::encode(&payload(largest), &mut buffer).expect("fits");
    assert!(frame.len() <= FRAME_BYTES);
    let mut receiver = Receiver::new();
    let received = frame.iter().filter(|&&byte| receiver.push(byte).is_some());
    assert_eq!(received.count(), 1);
    assert!(frame::encode(&payload(largest + 1), &mut buffer).is_err());
}

#[test]
fn the_receiver_distinguishes_good_damaged_and_overlong_frames() {
    let good = framed(&Request {
        id: 1,
        body: Body::Status,
    });
    let mut flipped = good.clone();
    flipped[2] ^= 2;
    let cut = [&good[..3], &[0]].concat();
    let overlong = [vec![1; 2000], vec![0]].concat();
    let mut receiver = Receiver::new();
    for (bytes, payloads) in [
        (&good, 1),
        (&flipped, 0),
        (&cut, 0),
        (&overlong, 0),
        // Zeros between frames are nothing.
        (&vec![0; 5], 0),
        (&good, 1),
    ] {
        let seen = bytes.iter().filter(|&&byte| receiver.push(byte).is_some());
        assert_eq!(seen.count(), payloads);
    }
    let expected = FrameCounters {
        good: 2,
        damaged: 2,
        overlong: 1,
        undecodable: 0,
    };
    assert_eq!(receiver.counters(), expected);
}

fn push_all(port: &mut LinkServer, bytes: &[u8]) -> Vec<Response> {
    let answers = bytes
        .iter()
        .filter_map(|&byte| port.push(byte, |_| Ok(Reply::Done)));
    answers.collect()
}

#[test]
fn nothing_but_stopping_is_let_through_before_hello() {
    let mut port = LinkServer::new();
    let mut ask = |body: Body| {
        let answer = push_all(&mut port, &framed(&Request { id: 3, body }));
        assert_eq!((answer.len(), answer[0].id), (1, 3));
        answer[0].result.clone()
    };
    assert_eq!(ask(Body::Enable), Err(LinkError::NoHello));
    assert_eq!(ask(Body::Status), Err(LinkError::NoHello));
    assert_eq!(ask(Body::Disable), Ok(Reply::Done));
    assert_eq!(ask(Body::Stop), Ok(Reply::Done));
    assert_eq!(ask(Body::Hello), Ok(Reply::Done));
    assert_eq!(ask(Body::Enable), Ok(Reply::Done));
    port.close();
    let enable = framed(&Request {
        id: 3,
        body: Body::Enable,
    });
    assert_eq!(
        push_all(&mut port, &enable)[0].result,
        Err(LinkError::NoHello)
    );
}

/// The frame of a request with another version's byte and, behind the number, what that version has.
fn of_version(version: u8, id: u8, body: &[u8]) -> Vec<u8> {
    let payload = [&[version, id], body].concat();
    let crc = crc32fast::hash(&payload).to_le_bytes();
    let mut encoded = [0; FRAME_BYTES];
    let length = cobs::encode(&[payload, crc.to_vec()].concat(), &mut encoded);
    [&encoded[..length], &[0]].concat()
}

#[test]
fn a_request_of_another_version_is_answered_with_both_versions() {
    let mut port = LinkServer::new();
    let answers = push_all(&mut port, &of_version(9, 5, &[200, 1, 2]));
    let error = LinkError::Version {
        yours: 9,
        mine: PROTOCOL_VERSION,
    };
    assert!(error.to_string().contains("version 9") && error.to_string().contains("version 1"));
    assert_eq!(
        answers,
        [Response {
            id: 5,
            result: Err(error)
        }]
    );
    assert_eq!(port.counters().undecodable, 1);
    assert_eq!(
        frame::decode::<Request>(&[9, 5, 0]),
        Err(DecodeError::Version(9))
    );
}

#[test]
fn a_request_that_this_version_does_not_have_is_answered_as_undecodable() {
    let mut port = LinkServer::new();
    let hello_and_more = of_version(PROTOCOL_VERSION, 4, &[0, 1]);
    let unknown = of_version(PROTOCOL_VERSION, 6, &[77]);
    let unknown_axes = of_version(PROTOCOL_VERSION, 7, &[7, 8]);
    for (frame, id) in [(hello_and_more, 4), (unknown, 6), (unknown_axes, 7)] {
        let answer = Response {
            id,
            result: Err(LinkError::Undecodable),
        };
        assert_eq!(push_all(&mut port, &frame), [answer]);
    }
    // Without a number there is nobody to answer.
    assert_eq!(push_all(&mut port, &of_version(1, 0xFF, &[])), []);
    assert_eq!(port.counters().undecodable, 4);
    assert!(!port.is_greeted());
}

#[test]
fn a_motion_with_a_number_that_is_none_is_refused_by_its_field() {
    let point = |position_mm, velocity_mm_s, acceleration_mm_s2| {
        let mut axes = [AxisPoint::default(); 3];
        axes[2] = AxisPoint {
            position_mm,
            velocity_mm_s,
            acceleration_mm_s2,
        };
        Body::Stream(StreamRequest::Points {
            sequence: 0,
            points: Bounded::from_slice(&[SetPoint::default(), SetPoint { axes }]).expect("two"),
            last: false,
        })
    };
    let axis = AxisName::Y;
    let moved = |target_mm, velocity_mm_s| Body::Move {
        axis,
        target_mm,
        velocity_mm_s,
    };
    for (body, field) in [
        (moved(f64::NAN, 1.0), "target_mm"),
        (moved(1.0, f64::INFINITY), "velocity_mm_s"),
        (
            Body::Jog {
                axis,
                velocity_mm_s: f64::NEG_INFINITY,
            },
            "velocity_mm_s",
        ),
        (point(f64::NAN, 0.0, 0.0), "position_mm"),
        (point(0.0, f32::NAN, 0.0), "velocity_mm_s"),
        (point(0.0, 0.0, f32::INFINITY), "acceleration_mm_s2"),
    ] {
        match body.check() {
            Err(LinkError::Invalid(text)) => assert!(text.starts_with(field), "{text}"),
            other => panic!("{field}: {other:?}"),
        }
    }
}

#[test]
fn a_text_that_is_too_long_is_cut_between_characters() {
    assert_eq!(text::<5>(format_args!("{}{}", "ab", "cd")), "abcd");
    assert_eq!(
        text::<5>(format_args!("{}{}{}", "ab", "cdef", "g")),
        "abcde"
    );
    assert_eq!(text::<4>(format_args!("{}{}", "abc", "\u{b5}m")), "abc");
    assert_eq!(text::<0>(format_args!("a")), "");
}

#[test]
fn sets_of_axes_hold_what_was_put_in() {
    let set = AxisSet::NONE.with(AxisName::X).with(AxisName::Z);
    assert!(set.iter().eq([AxisName::X, AxisName::Z]));
    assert!(!set.contains(AxisName::Y) && !set.is_empty() && AxisSet::NONE.is_empty());
    assert_eq!(u8::from(set), 5);
    assert_eq!(AxisName::ALL.into_iter().collect::<AxisSet>(), AxisSet::ALL);
    assert!(AxisSet::try_from(8).is_err());
}
