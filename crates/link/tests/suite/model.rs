//! A server to fuzz before: it does what a request asks of a machine made of flags, and keeps account.
//!
//! Shared with the targets of `fuzz/`.

use quadrant_link::frame::{self, FRAME_BYTES, Receiver};
use quadrant_link::message::CapturePhase;
use quadrant_link::message::{
    Applied, AxisSet, Body, CaptureRequest, CaptureStatus, LinkError, Message, PathPage,
    Provenance, Reply, Response, SettingsRequest, StreamRequest, StreamStatus, TelemetryRequest,
    Value, WordPage, text,
};
use quadrant_link::server::LinkServer;

/// The machine behind the model server.
#[derive(Default)]
pub(crate) struct Model {
    pub(crate) greeted: bool,
    pub(crate) enabled: bool,
    /// Number of times it was set in motion.
    pub(crate) motions: u32,
    next_point: Option<u32>,
}

impl Model {
    pub(crate) fn serve(&mut self, body: Body) -> Result<Reply, LinkError> {
        assert!(
            self.greeted || matches!(body, Body::Hello | Body::Disable | Body::Stop),
            "{} before hello",
            body.name()
        );
        match body {
            Body::Hello => self.greeted = true,
            Body::Enable => self.enabled = true,
            Body::Disable | Body::Reboot => {
                self.enabled = false;
                self.next_point = None;
            }
            Body::Move {
                target_mm,
                velocity_mm_s,
                ..
            } => {
                assert!(target_mm.is_finite() && velocity_mm_s.is_finite());
                self.start()?;
            }
            Body::Jog { velocity_mm_s, .. } => {
                assert!(velocity_mm_s.is_finite());
                self.start()?;
            }
            Body::Run | Body::Home(_) => self.start()?,
            Body::Stream(request) => return self.stream(request),
            Body::Settings(request) => return settings(request),
            Body::Telemetry(TelemetryRequest::Select {
                channels,
                decimation,
            }) => {
                if channels.is_empty() || decimation == 0 {
                    return Err(invalid("no channel, or never"));
                }
                return Ok(Reply::Telemetry { generation: 1 });
            }
            Body::Capture(CaptureRequest::Read { offset }) => {
                return Ok(Reply::Words(WordPage {
                    offset,
                    ..WordPage::default()
                }));
            }
            Body::Capture(_) => {
                return Ok(Reply::Capture(CaptureStatus {
                    phase: CapturePhase::Armed,
                    number: 1,
                    channels: Default::default(),
                    decimation: 1,
                    record: None,
                }));
            }
            _ => {}
        }
        Ok(Reply::Done)
    }

    fn start(&mut self) -> Result<(), LinkError> {
        if !self.enabled {
            return Err(LinkError::Refused(text(format_args!("outputs are off"))));
        }
        self.motions += 1;
        Ok(())
    }

    fn stream(&mut self, request: StreamRequest) -> Result<Reply, LinkError> {
        match request {
            StreamRequest::Open { .. } => {
                self.start()?;
                self.next_point = Some(0);
            }
            StreamRequest::Points {
                sequence, points, ..
            } => {
                let next = self
                    .next_point
                    .ok_or(LinkError::Refused(text(format_args!("no stream"))))?;
                if sequence > next {
                    return Err(invalid("sequence: a gap"));
                }
                let axes = points.iter().flat_map(|point| &point.axes);
                assert!(axes.clone().all(|axis| axis.position_mm.is_finite()));
                self.next_point = Some(next.max(sequence.saturating_add(points.len() as u32)));
            }
            StreamRequest::Close => self.next_point = None,
        }
        Ok(Reply::Stream(StreamStatus {
            next_sequence: self.next_point.unwrap_or(0),
            free: 8,
        }))
    }
}

fn settings(request: SettingsRequest) -> Result<Reply, LinkError> {
    Ok(match request {
        SettingsRequest::Get(path) => {
            let bytes = path.as_bytes().try_into().expect("a path is shorter");
            Reply::Value(Value { kind: 3, bytes })
        }
        SettingsRequest::Set { path, value } if path.is_empty() || value.bytes.is_empty() => {
            return Err(invalid("path: empty"));
        }
        SettingsRequest::List { .. } => Reply::Paths(PathPage::default()),
        SettingsRequest::Apply => Reply::Applied(Applied {
            changed: AxisSet::ALL,
            restart_needed: false,
        }),
        SettingsRequest::Provenance => Reply::Provenance(Provenance::new()),
        _ => Reply::Done,
    })
}

fn invalid(why: impl std::fmt::Display) -> LinkError {
    LinkError::Invalid(text(format_args!("{why}")))
}

/// Feeds bytes to a port before any server, and checks that each answer survives the way back. Gives the answers.
pub(crate) fn drive(
    port: &mut LinkServer,
    bytes: &[u8],
    mut serve: impl FnMut(Body) -> Result<Reply, LinkError>,
) -> Vec<Response> {
    let mut answers = Vec::new();
    for &byte in bytes {
        let Some(response) = port.push(byte, &mut serve) else {
            continue;
        };
        let message = Message::Response(response);
        assert_eq!(there_and_back(&message), message);
        let Message::Response(response) = message else {
            unreachable!("made above");
        };
        answers.push(response);
    }
    answers
}

/// The part of a message that arrives.
pub(crate) fn there_and_back<T: serde::Serialize + serde::de::DeserializeOwned>(message: &T) -> T {
    let mut buffer = [0; FRAME_BYTES];
    let sent = frame::encode(message, &mut buffer).expect("every message fits a frame");
    let mut receiver = Receiver::new();
    let (last, rest) = sent.split_last().expect("a frame has bytes");
    assert!(rest.iter().all(|&byte| receiver.push(byte).is_none()));
    let payload = receiver.push(*last).expect("a frame that was not touched");
    frame::decode(payload).expect("a message of this version")
}
