//! Client of the link in virtual time, at the far end of the board's serial line.

use anyhow::{Context, Result, anyhow};
use quadrant_link::frame::{self, FRAME_BYTES, Receiver};
use quadrant_link::message::{
    Body, Message, Notice, Path, Provenance, Reply, Request, SettingsRequest, Status, Value,
};
use quadrant_settings::StageSettings;
use quadrant_sim::setting_value;

use crate::bench::Bench;

/// Longest time to an answer, s.
const TIMEOUT_S: f64 = 5.0;
/// Time after which a request is repeated, s.
const REPEAT_S: f64 = 0.03;
/// Time between two looks at the line, s.
const LOOK_S: f64 = 0.0002;

/// A session.
#[derive(Default)]
pub struct Client {
    receiver: Receiver,
    id: u16,
    /// Notices so far.
    pub notices: Vec<Notice>,
}

impl Client {
    /// Opens a session.
    ///
    /// # Errors
    /// No answer.
    pub fn open(bench: &mut Bench) -> Result<Self> {
        let mut client = Self::default();
        client.ask(bench, Body::Hello)?;
        Ok(client)
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// None came, or a refusal, in its words.
    pub fn ask(&mut self, bench: &mut Bench, body: Body) -> Result<Reply> {
        let name = body.name();
        self.begin(bench, body)?;
        match self.answer(bench, TIMEOUT_S) {
            Some(result) => result.with_context(|| format!("request `{name}`")),
            None => Err(anyhow!("no answer to `{name}` within {TIMEOUT_S} s")),
        }
    }

    /// Asks for the status up to ten times, as a client may whose request got lost.
    ///
    /// # Errors
    /// No answer to the last one.
    pub fn status_at_last(&mut self, bench: &mut Bench) -> Result<Status> {
        for _ in 0..10 {
            self.begin(bench, Body::Status)?;
            if let Some(Ok(Reply::Status(status))) = self.answer(bench, REPEAT_S) {
                return Ok(status);
            }
        }
        Err(anyhow!("no answer to ten requests"))
    }

    /// Waits for the answer to the last request, s at most.
    pub fn answer(&mut self, bench: &mut Bench, limit_s: f64) -> Option<Result<Reply>> {
        let end = bench.now() + (limit_s * 1e9) as u64;
        while bench.now() < end {
            let left = (end - bench.now()) as f64 * 1e-9;
            bench.run_until_frame(left, LOOK_S, |_| false);
            let answer = self.take(bench);
            if answer.is_some() {
                return answer;
            }
        }
        None
    }

    /// Asks, and does not wait.
    ///
    /// # Errors
    /// The request is larger than a frame.
    pub fn begin(&mut self, bench: &Bench, body: Body) -> Result<()> {
        let frame = self.frame(body)?;
        bench.line.lock().expect("the line").to_board.extend(frame);
        Ok(())
    }

    /// The bytes of a request, between delimiters.
    ///
    /// # Errors
    /// The request is larger than a frame.
    pub fn frame(&mut self, body: Body) -> Result<Vec<u8>> {
        self.id = self.id.wrapping_add(1);
        let mut buffer = [0; FRAME_BYTES];
        let frame = frame::encode(&Request { id: self.id, body }, &mut buffer)
            .map_err(|error| anyhow!("{error}"))?;
        Ok([&[frame::DELIMITER], frame].concat())
    }

    /// Reads what the board has sent; returns the answer to the last request if it is among it.
    pub fn take(&mut self, bench: &Bench) -> Option<Result<Reply>> {
        let bytes = std::mem::take(&mut bench.line.lock().expect("the line").from_board);
        let mut answer = None;
        for byte in bytes {
            let Some(payload) = self.receiver.push(byte) else {
                continue;
            };
            match frame::decode::<Message>(payload) {
                Ok(Message::Notice(notice)) => self.notices.push(notice),
                Ok(Message::Response(response)) if response.id == self.id => {
                    answer = Some(response.result.map_err(|error| anyhow!("{error}")));
                }
                _ => {}
            }
        }
        answer
    }

    /// Asks for the status.
    ///
    /// # Errors
    /// No answer, or another one.
    pub fn status(&mut self, bench: &mut Bench) -> Result<Status> {
        match self.ask(bench, Body::Status)? {
            Reply::Status(status) => Ok(status),
            other => Err(anyhow!("a status was asked for, the answer is {other:?}")),
        }
    }

    /// Writes settings to the draft where they differ from those that it has, and applies it.
    ///
    /// # Errors
    /// A refusal.
    pub fn load(
        &mut self,
        bench: &mut Bench,
        settings: &StageSettings,
        present: &StageSettings,
    ) -> Result<()> {
        let present = values(present)?;
        for setting in values(settings)? {
            if !present.contains(&setting) {
                let (path, value) = setting;
                self.ask(bench, Body::Settings(SettingsRequest::Set { path, value }))?;
            }
        }
        self.ask(bench, Body::Settings(SettingsRequest::Apply))?;
        Ok(())
    }

    /// Stores the draft with its origin.
    ///
    /// # Errors
    /// A refusal.
    pub fn store(&mut self, bench: &mut Bench, origin: &str) -> Result<()> {
        self.ask(
            bench,
            Body::Settings(SettingsRequest::Store(provenance(origin)?)),
        )?;
        Ok(())
    }

    /// Reads the origin of the stored settings.
    ///
    /// # Errors
    /// A refusal, or another answer.
    pub fn origin(&mut self, bench: &mut Bench) -> Result<String> {
        match self.ask(bench, Body::Settings(SettingsRequest::Provenance))? {
            Reply::Provenance(origin) => Ok(origin.as_str().to_owned()),
            other => Err(anyhow!("an origin was asked for, the answer is {other:?}")),
        }
    }

    /// Number of settings in force that equal those given, and of all.
    ///
    /// # Errors
    /// A refusal.
    pub fn count_equal(
        &mut self,
        bench: &mut Bench,
        settings: &StageSettings,
    ) -> Result<(usize, usize)> {
        let values = values(settings)?;
        let mut equal = 0;
        for (path, value) in &values {
            let answer = self.ask(
                bench,
                Body::Settings(SettingsRequest::GetInForce(path.clone())),
            )?;
            equal += usize::from(answer == Reply::Value(value.clone()));
        }
        Ok((equal, values.len()))
    }
}

/// Paths and values of settings, parts before their leaves.
fn values(settings: &StageSettings) -> Result<Vec<(Path, Value)>> {
    let mut paths = Vec::new();
    settings
        .list("", &mut |path| paths.push(path.to_owned()))
        .map_err(|error| anyhow!("{error}"))?;
    let value = |path: &String| {
        let (kind, bytes) =
            setting_value::of(settings, path).map_err(|error| anyhow!("{path}: {error}"))?;
        let path = path
            .as_str()
            .try_into()
            .map_err(|_| anyhow!("{path} is too long"))?;
        Ok((path, Value { kind, bytes }))
    };
    paths.iter().map(value).collect()
}

/// An origin of settings, as the link has it.
///
/// # Errors
/// It is too long.
pub fn provenance(origin: &str) -> Result<Provenance> {
    origin
        .try_into()
        .map_err(|_| anyhow!("the origin is too long"))
}
