//! The link against a hostile or garbled stream: nothing panics, what was sent whole is received, nothing else is.

use proptest::prelude::*;
use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::frame::{self, FRAME_BYTES, PAYLOAD_BYTES, Receiver};
use quadrant_link::message::{Body, Reply, Request, Response};
use quadrant_link::server::LinkServer;

use crate::fuzz::{forged, payloads, stream};
use crate::model::{Model, drive, there_and_back};
use quadrant_test_support::traffic::{arrival, body, framed};
use quadrant_test_support::{Noise, repeatable};

/// A port whose client has said hello.
fn greeted(model: &mut Model) -> LinkServer {
    let mut port = LinkServer::new();
    let hello = framed(&Request {
        id: 0,
        body: Body::Hello,
    });
    drive(&mut port, &hello, |body| model.serve(body));
    assert!(port.is_greeted() && model.greeted);
    port
}

fn posted<T: serde::Serialize>(value: &T) -> Vec<u8> {
    let mut buffer = [0; PAYLOAD_BYTES];
    let used = postcard::to_slice(value, &mut buffer).expect("fits a payload");
    used.to_vec()
}

/// The fate of frames over a bad line.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    frames: u64,
    bytes: u64,
    intact: u64,
    received: u64,
    missed: u64,
    /// One trouble took away and another put back: a byte lost at the front, found at the end of the chunk before.
    restored: u64,
    slipped: u64,
    unintended_motions: u64,
}

/// Sends frames over a bad line to a model server.
fn bad_line(seed: u64, frames: u64) -> Tally {
    let mut noise = Noise::new(seed);
    let mut model = Model::default();
    let mut port = greeted(&mut model);
    let mut tally = Tally::default();
    for number in 0..frames {
        let arrival = arrival(&mut noise, number as u16);
        tally.frames += 1;
        tally.bytes += arrival.bytes.len() as u64;
        let mut expected = arrival.copies;
        tally.intact += expected as u64;
        for byte in arrival.bytes {
            port.push(byte, |body| {
                tally.received += 1;
                if body != arrival.request.body {
                    tally.slipped += 1;
                    tally.unintended_motions += u64::from(body.may_move());
                } else if expected > 0 {
                    expected -= 1;
                } else {
                    tally.restored += 1;
                }
                model.serve(body)
            });
        }
        tally.missed += expected as u64;
    }
    tally
}

fn assert_only_the_intact_were_received(tally: &Tally) {
    assert_eq!((tally.missed, tally.slipped), (0, 0), "{tally:?}");
    assert_eq!(tally.unintended_motions, 0, "{tally:?}");
    assert_eq!(tally.received, tally.intact + tally.restored, "{tally:?}");
    assert!(tally.intact > tally.frames / 3, "{tally:?}");
}

#[test]
fn over_a_bad_line_every_intact_request_is_received_and_nothing_else() {
    assert_only_the_intact_were_received(&bad_line(1, 50_000));
}

/// `cargo test -p quadrant-link --test suite ten_million -- --ignored --nocapture`
#[test]
#[ignore = "ten million frames take minutes"]
fn ten_million_frames_over_a_bad_line() {
    let start = std::time::Instant::now();
    let tally = bad_line(2, 10_000_000);
    println!("{tally:?} in {:.1} s", start.elapsed().as_secs_f64());
    assert_only_the_intact_were_received(&tally);
}

/// The committed corpus of a fuzz target, which has some files.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/");
    let files = std::fs::read_dir(format!("{folder}{target}")).expect("the corpus");
    let files: Vec<_> = files
        .map(|file| std::fs::read(file.expect("a file").path()).expect("readable"))
        .collect();
    assert!(files.len() > 20, "{} files for {target}", files.len());
    files
}

#[test]
fn what_fuzzing_has_found_is_replayed() {
    for data in corpus("stream") {
        let mut model = Model::default();
        stream(&data, |body| model.serve(body));
    }
    let mut motions = 0;
    for data in corpus("payloads") {
        let mut model = Model::default();
        payloads(&data, |body| model.serve(body));
        motions += model.motions;
    }
    assert!(motions > 0, "the corpus reaches the motions");
}

proptest! {
    #![proptest_config(repeatable(2000))]

    #[test]
    fn random_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut model = Model::default();
        drive(&mut LinkServer::new(), &bytes, |body| model.serve(body));
        prop_assert_eq!(model.motions, 0);
        prop_assert!(!model.enabled);
    }

    #[test]
    fn a_forged_payload_is_answered_once_and_moves_nothing_before_hello(
        payload in prop::collection::vec(any::<u8>(), 0..=PAYLOAD_BYTES),
    ) {
        let mut model = Model::default();
        let mut port = LinkServer::new();
        let answers = drive(&mut port, &forged(&payload), |body| model.serve(body));
        prop_assert!(answers.len() <= 1);
        prop_assert_eq!(model.motions, 0);
        prop_assert!(!model.enabled);
        prop_assert_eq!(port.counters().good, 1);
    }

    #[test]
    fn a_forged_body_of_this_version_is_always_answered(
        id in any::<u16>(),
        body in prop::collection::vec(any::<u8>(), 0..100),
        variant in 0u8..20,
    ) {
        let mut model = Model::default();
        let mut port = greeted(&mut model);
        let mut payload = vec![PROTOCOL_VERSION];
        payload.extend(posted(&id));
        payload.push(variant);
        payload.extend(body);
        let answers = drive(&mut port, &forged(&payload), |body| model.serve(body));
        prop_assert_eq!(answers.len(), 1);
        prop_assert_eq!(answers[0].id, id);
    }

    #[test]
    fn a_frame_after_garbage_and_a_zero_is_received(
        garbage in prop::collection::vec(any::<u8>(), 0..1500),
        seed in any::<u64>(),
    ) {
        let mut model = Model::default();
        let mut port = greeted(&mut model);
        drive(&mut port, &garbage, |body| model.serve(body));
        drive(&mut port, &[frame::DELIMITER], |body| model.serve(body));
        let request = Request { id: 9, body: body(&mut Noise::new(seed)) };
        let mut received = None;
        let answers = drive(&mut port, &framed(&request), |body| {
            received = Some(body);
            Ok(Reply::Done)
        });
        prop_assert_eq!(received, Some(request.body));
        prop_assert_eq!(answers, vec![Response { id: 9, result: Ok(Reply::Done) }]);
    }

    #[test]
    fn up_to_three_flipped_bits_of_a_body_are_always_found(
        seed in any::<u64>(),
        bits in prop::collection::btree_set(0usize..8 * 508, 1..=3),
    ) {
        // Below COBS, where a flipped bit stays one flipped bit: CRC-32's distance is 4 at this length.
        let request = Request { id: 1, body: body(&mut Noise::new(seed)) };
        let mut body = vec![PROTOCOL_VERSION];
        body.extend(posted(&request));
        body.extend(crc32fast::hash(&body).to_le_bytes());
        let length = 8 * body.len();
        let bits: std::collections::BTreeSet<_> = bits.into_iter().map(|bit| bit % length).collect();
        for bit in bits {
            body[bit / 8] ^= 1 << (bit % 8);
        }
        let mut receiver = Receiver::new();
        let mut encoded = vec![0; 2 * FRAME_BYTES];
        let used = cobs::encode(&body, &mut encoded);
        for &byte in encoded[..used].iter().chain(&[frame::DELIMITER]) {
            prop_assert!(receiver.push(byte).is_none());
        }
        prop_assert_eq!(receiver.counters().damaged, 1);
    }

    #[test]
    fn every_request_survives_the_way(seed in any::<u64>(), id in any::<u16>()) {
        let request = Request { id, body: body(&mut Noise::new(seed)) };
        prop_assert_eq!(there_and_back(&request), request);
    }
}
