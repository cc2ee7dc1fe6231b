//! The fuzzed functions: any bytes before a port and a server. The targets of `fuzz/` are these functions; here they replay the
//! corpus.

use quadrant_link::frame::{self, FRAME_BYTES, PAYLOAD_BYTES};
use quadrant_link::message::{Body, LinkError, Reply, Request};
use quadrant_link::server::LinkServer;

use crate::model::{drive, there_and_back};

/// A frame with a right CRC around any payload.
pub(crate) fn forged(payload: &[u8]) -> Vec<u8> {
    let crc = crc32fast::hash(payload).to_le_bytes();
    let mut encoded = vec![0; 2 * FRAME_BYTES];
    let length = cobs::encode(&[payload, &crc].concat(), &mut encoded);
    encoded.truncate(length);
    encoded.push(frame::DELIMITER);
    encoded
}

/// The stream as it is; behind it and a zero, a request that must be received.
pub(crate) fn stream(data: &[u8], mut serve: impl FnMut(Body) -> Result<Reply, LinkError>) {
    let mut port = LinkServer::new();
    drive(&mut port, data, &mut serve);
    drive(&mut port, &[frame::DELIMITER], &mut serve);
    let mut buffer = [0; FRAME_BYTES];
    let hello = Request {
        id: 0xABCD,
        body: Body::Hello,
    };
    let hello = frame::encode(&hello, &mut buffer).expect("fits");
    let answers = drive(&mut port, hello, &mut serve);
    assert_eq!((answers.len(), answers[0].id), (1, 0xABCD));
}

/// The stream cut into payloads, each behind its length in two bytes, and framed with a right CRC. Each is answered at
/// most once, and what decodes as a request decodes so again after it was sent.
pub(crate) fn payloads(mut data: &[u8], mut serve: impl FnMut(Body) -> Result<Reply, LinkError>) {
    let mut port = LinkServer::new();
    while let Some((&[low, high], rest)) = data.split_first_chunk() {
        let length = usize::from(u16::from_le_bytes([low, high]));
        let length = length.min(rest.len()).min(PAYLOAD_BYTES);
        let (payload, rest) = rest.split_at(length);
        data = rest;
        if let Ok(request) = frame::decode::<Request>(payload) {
            assert_eq!(posted(&there_and_back(&request)), posted(&request));
        }
        let answers = drive(&mut port, &forged(payload), &mut serve);
        assert!(answers.len() <= 1);
    }
}

/// A request's bytes: unlike the request, they equal themselves also with a number in it that is none.
fn posted(request: &Request) -> Vec<u8> {
    let mut buffer = [0; PAYLOAD_BYTES];
    let used = postcard::to_slice(request, &mut buffer).expect("fits a payload");
    used.to_vec()
}
