//! Requests, answers, and what a bad line or a bad moment makes of them.

use std::io;
use std::time::Duration;

use quadrant_link::frame::{self, FRAME_BYTES};
use quadrant_link::message::AxisName;
use quadrant_link::message::MachineState;
use quadrant_link::message::{Body, Event, LinkError, Message, Notice, Reply, Response};

use super::connected;
use crate::client::{Client, ClientError, settings, settle};
use crate::machine::Transport;

fn count(requests: &[&str], name: &str) -> usize {
    requests.iter().filter(|request| **request == name).count()
}

#[test]
fn a_session_names_its_machine() {
    let (client, _) = connected();
    assert_eq!(client.identity().board, "model");
    assert_eq!(client.endpoint(), "the simulated machine");
}

#[test]
fn answers_are_found_between_garbage_and_broken_frames() {
    let (mut client, bench) = connected();
    for seed in 1..60_u8 {
        // Ends with a zero at times, and in the middle of a frame at others.
        let noise = (0..seed).map(|k| k.wrapping_mul(31) ^ seed).collect();
        bench.borrow_mut().noise = noise;
        // What the line glued to an answer is lost with it; the request is repeated until one comes through.
        match client.status() {
            Ok(status) => assert_eq!(status.state, MachineState::Disabled),
            Err(ClientError::Silent { .. }) => {}
            Err(other) => panic!("{other}"),
        }
    }
    bench.borrow_mut().noise = vec![7, 0, 1, 2, 3, 0];
    assert_eq!(client.status().unwrap().state, MachineState::Disabled);
}

#[test]
fn a_request_that_may_be_repeated_survives_lost_answers() {
    let (mut client, bench) = connected();
    bench.borrow_mut().lose_answers = 3;
    client.order(Body::Disable).unwrap();
    assert_eq!(count(&bench.borrow().requests, "disable"), 4);
}

/// It would end the motion of a host that is silent for half a second.
#[test]
fn a_machine_that_is_long_at_an_answer_still_gets_requests_of_its_host_if_that_moves_it() {
    let (mut client, bench) = connected();
    let apply = |client: &mut Client| {
        bench.borrow_mut().answer_after_ms = 2000;
        bench.borrow_mut().requests.clear();
        settings::apply(client).unwrap();
        let asked = count(&bench.borrow().requests, "status");
        // What came late is no answer to what comes next.
        assert!(client.fault().unwrap().is_none());
        asked
    };
    assert_eq!(apply(&mut client), 0);
    client.order(Body::Enable).unwrap();
    client.order(Body::Run).unwrap();
    assert!(apply(&mut client) >= 6);
}

/// Somebody at the machine may have switched off meanwhile.
#[test]
fn what_enables_or_moves_is_asked_once() {
    let jog = |velocity_mm_s| Body::Jog {
        axis: AxisName::X,
        velocity_mm_s,
    };
    for body in [Body::Enable, Body::Run, jog(1.0)] {
        let (mut client, bench) = connected();
        bench.borrow_mut().lose_answers = 1;
        let error = client.order(body.clone()).unwrap_err();
        assert!(matches!(error, ClientError::Unsure { .. }), "{error}");
        assert_eq!(count(&bench.borrow().requests, body.name()), 1);
        bench.borrow_mut().busy = 1;
        assert!(client.order(body.clone()).is_err());
        assert_eq!(count(&bench.borrow().requests, body.name()), 2);
    }
    let (mut client, bench) = connected();
    bench.borrow_mut().lose_answers = 1;
    let _ = client.order(jog(0.0));
    assert_eq!(count(&bench.borrow().requests, "jog"), 2);
}

#[test]
fn a_reset_is_never_made_twice() {
    let (mut client, bench) = connected();
    bench.borrow_mut().lose_answers = 1;
    let error = client.order(Body::ResetFault).unwrap_err();
    assert!(matches!(error, ClientError::Unsure { .. }), "{error}");
    assert!(error.to_string().contains("`status`"), "{error}");
    assert_eq!(count(&bench.borrow().requests, "reset-fault"), 1);
}

#[test]
fn silence_says_what_was_asked_where_how_long_and_what_to_check() {
    let (mut client, bench) = connected();
    bench.borrow_mut().lose_answers = 100;
    let text = client.status().unwrap_err().to_string();
    for part in ["status", "the simulated machine", "600 ms", "4 times"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_late_answer_is_an_answer_and_a_second_one_none() {
    let (mut client, bench) = connected();
    bench.borrow_mut().lose_answers = 1;
    assert!(matches!(client.request(Body::Status), Ok(Reply::Status(_))));
    // The next request is not answered by what is left over.
    assert!(matches!(
        client.request(Body::Fault),
        Ok(Reply::Fault(None))
    ));
}

#[test]
fn a_busy_machine_is_asked_again() {
    let (mut client, bench) = connected();
    bench.borrow_mut().busy = 5;
    client.order(Body::Stop).unwrap();
    assert_eq!(count(&bench.borrow().requests, "stop"), 6);
    bench.borrow_mut().busy = u32::MAX;
    let error = client.order(Body::Disable).unwrap_err();
    assert!(error.to_string().contains("another change"), "{error}");
}

#[test]
fn a_restart_is_reported_to_a_request_for_motion_and_not_to_a_question() {
    let (mut client, bench) = connected();
    client.order(Body::Enable).unwrap();
    bench.borrow_mut().restart = true;
    let status = client.status().unwrap();
    assert_eq!(status.state, MachineState::Disabled);
    bench.borrow_mut().restart = true;
    client.wait(Duration::from_millis(2)).unwrap();
    let error = client.order(Body::Enable).unwrap_err();
    assert!(matches!(error, ClientError::Restarted { .. }), "{error}");
    // Not enabled behind the user's back; and the session is open again.
    assert_eq!(client.status().unwrap().state, MachineState::Disabled);
    client.order(Body::Enable).unwrap();
}

#[test]
fn a_refusal_carries_the_machines_words() {
    let (mut client, _) = connected();
    let error = client.order(Body::Run).unwrap_err().to_string();
    assert!(error.contains("outputs are off; `enable` first"), "{error}");
}

#[test]
fn notices_wait_until_someone_asks() {
    let (mut client, _) = connected();
    client.order(Body::Enable).unwrap();
    client
        .order(Body::Move {
            axis: AxisName::Y,
            target_mm: 1.0,
            velocity_mm_s: 20.0,
        })
        .unwrap();
    let status = settle::rest(&mut client, Duration::from_secs(1)).unwrap();
    assert!((status.axes[1].position_mm - 1.0).abs() < 1e-9);
    let events: Vec<_> = client
        .take_notices()
        .filter_map(|notice| match notice {
            Notice::Event { event, .. } => Some(event),
            _ => None,
        })
        .collect();
    assert_eq!(events, [Event::MotionStarted, Event::MotionFinished]);
    assert_eq!(client.notice(Duration::from_millis(5)).unwrap(), None);
}

#[test]
fn waiting_ends_with_a_fault_and_its_remedy() {
    let (mut client, bench) = connected();
    client.order(Body::Enable).unwrap();
    client
        .order(Body::Jog {
            axis: AxisName::X,
            velocity_mm_s: 1.0,
        })
        .unwrap();
    let error = settle::rest(&mut client, Duration::from_millis(100)).unwrap_err();
    assert!(matches!(error, ClientError::TimedOut { .. }), "{error}");
    bench.borrow_mut().fault = Some(9);
    let error = settle::rest(&mut client, Duration::from_secs(1))
        .unwrap_err()
        .to_string();
    for part in [
        "fault 9 emergency-stop",
        "is pressed",
        "release it",
        "`reset`",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
}

/// Answers every frame with the bytes given.
struct Parrot(Vec<u8>, usize);

impl Transport for Parrot {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        self.1 = 0;
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
        let left = &self.0[self.1..];
        let count = left.len().min(buffer.len());
        buffer[..count].copy_from_slice(&left[..count]);
        self.1 += count;
        if count == 0 {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        Duration::ZERO
    }

    fn endpoint(&self) -> String {
        "a parrot".to_owned()
    }

    fn remedy(&self) -> &'static str {
        "buy a new one"
    }
}

#[test]
fn another_version_of_the_protocol_is_reported_in_words() {
    // The answer of a firmware of version 7: the frame's own version byte, and the error that never changes.
    let message = Message::Response(Response {
        id: 1,
        result: Err(LinkError::Version { yours: 1, mine: 7 }),
    });
    let mut payload = [0; 64];
    let mut plain = postcard::to_slice(&message, &mut payload).unwrap().to_vec();
    plain.insert(0, 7);
    let crc = crc32(&plain);
    plain.extend(crc.to_le_bytes());
    let mut bytes = cobs(&plain);
    bytes.push(0);
    let error = Client::open(Parrot(bytes, 0)).err().unwrap().to_string();
    assert!(
        error.contains("a parrot speaks protocol version 7, this program version 1"),
        "{error}"
    );
    // A firmware that answers in our version that it speaks another.
    let mut buffer = [0; FRAME_BYTES];
    let bytes = frame::encode(&message, &mut buffer).unwrap().to_vec();
    let error = Client::open(Parrot(bytes, 0)).err().unwrap().to_string();
    assert!(error.contains("version 7"), "{error}");
}

#[test]
fn a_broken_connection_says_where_and_what_to_do() {
    let error = Client::open(Parrot(Vec::new(), 0))
        .err()
        .unwrap()
        .to_string();
    assert!(
        error.contains("a parrot") && error.contains("buy a new one"),
        "{error}"
    );
}

/// CRC-32 bit by bit, and COBS of fewer than 254 bytes: written again, so that a version byte can be set.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

fn cobs(bytes: &[u8]) -> Vec<u8> {
    bytes
        .split(|byte| *byte == 0)
        .flat_map(|part| std::iter::once(part.len() as u8 + 1).chain(part.iter().copied()))
        .collect()
}

#[test]
fn an_interruption_stops_what_is_under_way_and_starts_nothing_until_a_person_goes_on() {
    let (mut client, bench) = connected();
    client.order(Body::Enable).unwrap();
    let jog = Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: 1.0,
    };
    client.order(jog.clone()).unwrap();
    client.interrupt().request();
    let error = settle::rest(&mut client, Duration::from_secs(1000)).unwrap_err();
    assert_eq!(error.to_string(), "interrupted: the axes have stopped");
    let status = client.status().unwrap();
    assert!(!status.running);
    assert_eq!(status.state, MachineState::Enabled);
    let error = client.order(jog.clone()).unwrap_err();
    assert!(matches!(error, ClientError::Interrupted { .. }), "{error}");
    assert_eq!(count(&bench.borrow().requests, "jog"), 1);
    client.resume();
    client.order(jog).unwrap();
}

#[test]
fn a_second_interruption_disables_the_outputs() {
    let (mut client, bench) = connected();
    client.order(Body::Enable).unwrap();
    client.interrupt().request();
    client.interrupt().request();
    let error = client.wait(Duration::from_secs(1)).unwrap_err();
    assert_eq!(error.to_string(), "interrupted: the outputs are off");
    assert_eq!(count(&bench.borrow().requests, "stop"), 1);
    assert_eq!(client.status().unwrap().state, MachineState::Disabled);
}

#[test]
fn a_host_that_has_started_a_motion_shows_that_it_is_there() {
    let (mut client, bench) = connected();
    client.order(Body::Enable).unwrap();
    client.wait(Duration::from_secs(2)).unwrap();
    assert_eq!(count(&bench.borrow().requests, "status"), 0);
    client
        .order(Body::Jog {
            axis: AxisName::X,
            velocity_mm_s: 1.0,
        })
        .unwrap();
    client.wait(Duration::from_secs(2)).unwrap();
    assert!(count(&bench.borrow().requests, "status") >= 5);
}
