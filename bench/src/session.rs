//! The page's end of the link: requests by name become frames, and a machine's bytes become JSON and numbers.
//!
//! It has no clock and repeats nothing; when an answer is late is for the page to judge.

use std::collections::BTreeMap;

use quadrant_link::frame::{self, DELIMITER, DecodeError, FRAME_BYTES, Receiver};
use quadrant_link::message::{
    Body, Channel, LinkError, Message, Notice, Reply, Request, SettingsRequest, TelemetryBlock,
    TelemetryRequest, Value as LeafValue,
};
use quadrant_settings::StageSettings;
use quadrant_sim::setting_value;
use serde_json::{Value, json};

use crate::ask::Ask;
use crate::wording;

/// Control rate until the machine has reported its own, Hz.
const RATE_HZ: f64 = 10_000.0;
/// Requests whose answers are waited for at most; of more, the oldest is forgotten.
const MOST_ASKED: usize = 64;

/// Channels that are sampled.
#[derive(Debug)]
struct Selection {
    generation: u8,
    channels: Vec<Channel>,
    sample_time_s: f64,
}

/// A session with a machine.
pub struct Session {
    receiver: Receiver,
    next_id: u16,
    /// The requests that have no answer yet.
    asked: BTreeMap<u16, Body>,
    selection: Option<Selection>,
    /// Settings as far as the machine has reported them; at first those of the simulated stage.
    settings: StageSettings,
    rate_hz: f64,
}

impl Default for Session {
    fn default() -> Self {
        Self {
            receiver: Receiver::new(),
            next_id: 1,
            asked: BTreeMap::new(),
            selection: None,
            settings: StageSettings::simulated(),
            rate_hz: RATE_HZ,
        }
    }
}

impl Session {
    /// Writes the frame of a request to `frame`, and returns its number and its name: `{"id": 7, "request": "jog"}`.
    ///
    /// # Errors
    /// In words: a request that there is not.
    pub fn ask(&mut self, request: &[u8], frame: &mut Vec<u8>) -> Result<Value, String> {
        let ask: Ask = serde_json::from_slice(request).map_err(|error| error.to_string())?;
        let body = ask.body(self.rate_hz)?;
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        // Ends what the other end takes for a frame's beginning: these are not to be lost with it.
        if matches!(body, Body::Hello | Body::Stop | Body::Disable) {
            frame.push(DELIMITER);
        }
        let mut buffer = [0; FRAME_BYTES];
        let request = Request { id, body };
        let sent = frame::encode(&request, &mut buffer).map_err(|error| error.to_string())?;
        frame.extend_from_slice(sent);
        let name = request.body.name();
        self.asked.insert(id, request.body);
        if self.asked.len() > MOST_ASKED {
            self.asked.pop_first();
        }
        Ok(json!({ "id": id, "request": name }))
    }

    /// Takes bytes of the machine and returns its messages, in order: `{"answer": ...}`, `{"event": ...}`, `{"log": ...}`, or
    /// `{"foreign": ...}` from a machine of another release. Samples go to `samples`: the time since the selection, s,
    /// and then a value of each channel in the unit in which it is shown.
    pub fn take(&mut self, bytes: &[u8], samples: &mut Vec<f64>) -> Vec<Value> {
        let mut messages = Vec::new();
        for &byte in bytes {
            let Some(payload) = self.receiver.push(byte) else {
                continue;
            };
            match frame::decode::<Message>(payload) {
                Ok(Message::Response(response)) => {
                    messages.extend(self.answer(response.id, response.result));
                }
                Ok(Message::Notice(Notice::Telemetry(block))) => self.sample(&block, samples),
                Ok(Message::Notice(Notice::Event { tick, event, .. })) => {
                    messages.push(json!({ "event": wording::event(tick, &event, self.rate_hz) }));
                }
                Ok(Message::Notice(Notice::Log(text))) => messages.push(json!({ "log": text })),
                Err(error @ DecodeError::Version(_)) => {
                    messages.push(json!({ "foreign": error.to_string() }));
                }
                // A message that a later release of this version has added.
                Err(DecodeError::Malformed) => {}
            }
        }
        messages
    }

    /// The answer to a request that was made; another's is passed over.
    fn answer(&mut self, id: u16, result: Result<Reply, LinkError>) -> Option<Value> {
        let body = self.asked.remove(&id)?;
        let mut answer = json!({ "id": id, "request": body.name() });
        match result.map(|reply| self.reply(&body, reply)) {
            Ok(Ok(reply)) => answer["ok"] = reply,
            Ok(Err(error)) => answer["error"] = json!(error),
            Err(error) => {
                answer["error"] = json!(error.to_string());
                answer["restarted"] = json!(error == LinkError::NoHello);
            }
        }
        Some(json!({ "answer": answer }))
    }

    fn reply(&mut self, body: &Body, reply: Reply) -> Result<Value, String> {
        Ok(match reply {
            Reply::Done => Value::Null,
            Reply::Identity(identity) => {
                self.rate_hz = identity.rate_hz;
                json!(identity)
            }
            Reply::Status(status) => wording::status(&status, self.rate_hz),
            Reply::Inputs(inputs) => wording::inputs(&inputs),
            Reply::Fault(fault) => wording::fault(fault.as_ref(), self.rate_hz),
            Reply::Paths(page) => json!(page),
            Reply::Value(value) => return self.value(body, &value),
            Reply::Applied(applied) => json!({
                "axes": wording::names(applied.changed),
                "restart_needed": applied.restart_needed,
            }),
            Reply::Telemetry { generation } => self.select(body, generation),
            _ => return Err("the machine answered with something else".to_owned()),
        })
    }

    /// A value as JSON; that of the draft is remembered, for lengths of counts and for bounds.
    fn value(&mut self, body: &Body, value: &LeafValue) -> Result<Value, String> {
        let Body::Settings(SettingsRequest::Get(path) | SettingsRequest::GetInForce(path)) = body
        else {
            return Err("the machine answered with a value that was not asked for".to_owned());
        };
        let json = setting_value::to_json(path, value.kind, &value.bytes)
            .map_err(|error| error.to_string())?;
        let json = serde_json::from_str(&json).unwrap_or(Value::String(json));
        if matches!(body, Body::Settings(SettingsRequest::Get(_))) {
            // It was taken by settings with every part; these may lack the part, which changes no bound.
            let _ = self.settings.set_bytes(path, value.kind, &value.bytes);
        }
        Ok(wording::setting(path, json, &self.settings))
    }

    /// Takes samples of what was selected from now on, and returns their channels and time apart, s.
    fn select(&mut self, body: &Body, generation: u8) -> Value {
        let Body::Telemetry(TelemetryRequest::Select {
            channels,
            decimation,
        }) = body
        else {
            self.selection = None;
            return Value::Null;
        };
        let shown: Vec<Value> = channels
            .iter()
            .map(|channel| json!({ "name": channel.to_string(), "unit": channel.shown_unit().0 }))
            .collect();
        let sample_time_s = f64::from(*decimation) / self.rate_hz;
        self.selection = Some(Selection {
            generation,
            channels: channels.to_vec(),
            sample_time_s,
        });
        json!({ "channels": shown, "sample_time_s": sample_time_s })
    }

    fn sample(&self, block: &TelemetryBlock, samples: &mut Vec<f64>) {
        let Some(selection) = self.selection.as_ref().filter(|selection| {
            selection.generation == block.generation
                && selection.channels.len() == usize::from(block.channels)
        }) else {
            return;
        };
        // The length of a count of each axis, mm.
        let resolution_mm = self.settings.axes.each_ref();
        let resolution_mm = resolution_mm.map(|axis| axis.encoder.resolution_mm);
        for (number, words) in block.samples() {
            samples.push(f64::from(number) * selection.sample_time_s);
            for (channel, word) in selection.channels.iter().zip(words) {
                let value = channel.physical(channel.value(word), &resolution_mm);
                samples.push(channel.shown_unit().1 * value);
            }
        }
    }
}

/// Every channel that can be sampled, with the unit in which it is shown.
pub fn channels() -> Value {
    Channel::all()
        .map(|channel| json!({ "name": channel.to_string(), "unit": channel.shown_unit().0 }))
        .collect()
}

#[cfg(test)]
mod tests {
    use quadrant_link::message::{
        AxisName, AxisSignal, Event, MAX_CHANNELS, Response, SampleWords, TelemetryBlock,
    };
    use quadrant_link::server::LinkServer;

    use super::*;

    /// The bytes of a machine's message.
    fn bytes(message: &Message) -> Vec<u8> {
        let mut buffer = [0; FRAME_BYTES];
        frame::encode(message, &mut buffer).unwrap().to_vec()
    }

    /// Asks, lets `reply` be the answer, and returns what the page receives.
    fn exchange(session: &mut Session, request: &str, reply: Result<Reply, LinkError>) -> Value {
        let asked = session.ask(request.as_bytes(), &mut Vec::new()).unwrap();
        let response = Response {
            id: asked["id"].as_u64().unwrap() as u16,
            result: reply,
        };
        let messages = session.take(&bytes(&Message::Response(response)), &mut Vec::new());
        messages[0]["answer"].clone()
    }

    #[test]
    fn a_stop_arrives_though_noise_had_begun_a_frame() {
        let mut session = Session::default();
        let mut server = LinkServer::new();
        let mut sent = vec![0x2A, 0x17, 0xFF];
        session.ask(br#""stop""#, &mut sent).unwrap();
        let mut stopped = false;
        for byte in sent {
            server.push(byte, |body| {
                stopped = body == Body::Stop;
                Ok(Reply::Done)
            });
        }
        assert!(stopped);
    }

    #[test]
    fn samples_come_in_the_units_in_which_they_are_shown() {
        let mut session = Session::default();
        let selected = exchange(
            &mut session,
            r#"{"watch": {"channels": ["x.error", "y.position"], "window_s": 30.0}}"#,
            Ok(Reply::Telemetry { generation: 3 }),
        );
        assert_eq!(
            selected["ok"]["channels"],
            json!([{"name": "x.error", "unit": "um"}, {"name": "y.position", "unit": "mm"}])
        );
        let mut words = SampleWords::new();
        assert!(words.extend([0.002_f32.to_bits(), 2000, 0.003_f32.to_bits(), 2001].into_iter()));
        let block = |generation| {
            bytes(&Message::Notice(Notice::Telemetry(TelemetryBlock {
                generation,
                sequence: 7,
                tick: 700,
                channels: 2,
                words: words.clone(),
                ..TelemetryBlock::default()
            })))
        };
        let mut samples = Vec::new();
        session.take(&block(2), &mut samples);
        assert!(samples.is_empty(), "of an older selection");
        session.take(&block(3), &mut samples);
        let count_mm = StageSettings::simulated().axes[1].encoder.resolution_mm;
        // 30 s on a chart are a sample every 100 ticks.
        let expected = [0.07, 2.0, 2000.0 * count_mm, 0.08, 3.0, 2001.0 * count_mm];
        assert_eq!(samples.len(), expected.len());
        for (sample, expected) in samples.iter().zip(expected) {
            assert!((sample - expected).abs() < 1e-6, "{samples:?}");
        }
    }

    #[test]
    fn the_length_of_a_count_is_the_machine_s() {
        let mut session = Session::default();
        let path = "/axes/2/encoder/resolution_mm";
        let (kind, bytes) = setting_value::from_json(path, "0.002").unwrap();
        let answer = exchange(
            &mut session,
            &json!({ "get": { "path": path } }).to_string(),
            Ok(Reply::Value(LeafValue { kind, bytes })),
        );
        assert_eq!(answer["ok"]["value"], 0.002);
        assert_eq!(answer["ok"]["unit"], "mm");
        assert_eq!(session.settings.axes[2].encoder.resolution_mm, 0.002);
    }

    #[test]
    fn a_refusal_and_a_restart_are_distinguished() {
        let mut session = Session::default();
        let text = quadrant_link::message::text(format_args!("home x first"));
        let refused = exchange(&mut session, r#""enable""#, Err(LinkError::Refused(text)));
        assert_eq!(refused["error"], "refused: home x first");
        assert_eq!(refused["restarted"], false);
        let closed = exchange(&mut session, r#""status""#, Err(LinkError::NoHello));
        assert_eq!(closed["restarted"], true);
    }

    #[test]
    fn events_and_machines_of_other_releases_are_reported_in_words() {
        let mut session = Session::default();
        let event = Message::Notice(Notice::Event {
            sequence: 0,
            tick: 5000,
            event: Event::Fault {
                code: 3,
                axis: Some(AxisName::X),
            },
        });
        let messages = session.take(&bytes(&event), &mut Vec::new());
        assert_eq!(messages[0]["event"]["text"], "fault 3 of x");
        assert_eq!(messages[0]["event"]["time_s"], 0.5);
        // The payload 09 00, with a right CRC.
        let foreign = [0x02, 0x09, 0x05, 0xB6, 0xA9, 0x1B, 0x90, 0x00];
        let messages = session.take(&foreign, &mut Vec::new());
        assert!(
            messages[0]["foreign"]
                .as_str()
                .unwrap()
                .contains("version 9")
        );
    }

    #[test]
    fn every_channel_fits_a_selection_of_its_own() {
        let all = channels();
        assert!(all.as_array().unwrap().len() > MAX_CHANNELS);
        let error = Channel::Axis(AxisName::X, AxisSignal::Error);
        assert!(
            all.as_array()
                .unwrap()
                .contains(&json!({"name": error.to_string(), "unit": "um"}))
        );
    }
}
