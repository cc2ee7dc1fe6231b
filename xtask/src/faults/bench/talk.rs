//! The host at the link of a bench.

use std::collections::VecDeque;

use anyhow::{Context, Result, anyhow, bail, ensure};
use quadrant::link::frame::{self, FRAME_BYTES, Receiver};
use quadrant::lockstep::{
    LINK_BYTES, LINK_IN, LINK_IN_TAKEN, LINK_IN_WRITTEN, LINK_OUT, LINK_OUT_SHOWN, LINK_OUT_TAKEN,
};
use quadrant::link::message::{
    Body, FaultReport, LinkError, Message, Reply, Request, Response, Status,
};

use super::Bench;

/// Ticks within which a request must be answered.
const ANSWER_TICKS: u32 = 2_000;

/// What the host has sent and heard.
#[derive(Default)]
pub(super) struct Talk {
    to_send: VecDeque<u8>,
    /// Bytes written to the ring.
    sent: u32,
    /// Bytes read from the other, and how many of these the firmware has been told of.
    read: u32,
    taken: u32,
    /// Bytes of which it is told with the next tick.
    freed: usize,
    /// The firmware is not told.
    is_deaf: bool,
    receiver: Receiver,
    answer: Option<Response>,
    last_request: u16,
}

impl Talk {
    /// Bytes that the host has taken since this was asked.
    pub(super) fn freed(&mut self) -> usize {
        std::mem::take(&mut self.freed)
    }
}

impl Bench {
    /// Lets the host take no more bytes.
    pub(in crate::faults) fn grow_deaf(&mut self) {
        self.talk.is_deaf = true;
    }

    /// Sends bytes, as fast as the ring takes them.
    pub(in crate::faults) fn send_bytes(&mut self, bytes: &[u8]) {
        self.talk.to_send.extend(bytes);
    }

    /// Bytes that the ring has not taken yet.
    pub(in crate::faults) fn unsent(&self) -> usize {
        self.talk.to_send.len()
    }

    /// Asks, and waits for the answer.
    pub(in crate::faults) fn ask(&mut self, body: Body) -> Result<Result<Reply, LinkError>> {
        let id = self.talk.last_request.wrapping_add(1);
        self.talk.last_request = id;
        let name = body.name();
        let mut buffer = [0; FRAME_BYTES];
        let frame = frame::encode(&Request { id, body }, &mut buffer)
            .map_err(|error| anyhow!("{name}: {error}"))?;
        self.send_bytes(frame);
        self.run_until(ANSWER_TICKS, &format!("an answer to {name}"), |bench| {
            bench.talk.answer.is_some()
        })?;
        let response = self.talk.answer.take().context("it has just come")?;
        ensure!(
            response.id == id,
            "an answer to another request: {response:?}"
        );
        Ok(response.result)
    }

    /// Asks for something that must be done.
    pub(in crate::faults) fn reply(&mut self, body: Body) -> Result<Reply> {
        let name = body.name();
        self.ask(body)?
            .map_err(|error| anyhow!("{name} was refused: {error}"))
    }

    /// The same, where there is nothing to be told.
    pub(in crate::faults) fn done(&mut self, body: Body) -> Result<()> {
        self.reply(body).map(drop)
    }

    /// Which fault is latched, or being braked for, by the firmware's own account.
    pub(in crate::faults) fn fault(&mut self) -> Result<Option<FaultReport>> {
        match self.reply(Body::Fault)? {
            Reply::Fault(report) => Ok(report),
            other => bail!("no report of a fault: {other:?}"),
        }
    }

    /// How the firmware is.
    pub(in crate::faults) fn status(&mut self) -> Result<Status> {
        match self.reply(Body::Status)? {
            Reply::Status(status) => Ok(status),
            other => bail!("no status: {other:?}"),
        }
    }

    /// Writes what the ring takes; gives it.
    pub(super) fn send(&mut self) -> Result<Vec<u8>> {
        let talk = &mut self.talk;
        let waiting = talk.sent.wrapping_sub(self.memory.word(LINK_IN_TAKEN)?) as usize;
        let count = (LINK_BYTES - waiting).min(talk.to_send.len());
        let bytes: Vec<u8> = talk.to_send.drain(..count).collect();
        for (at, byte) in (talk.sent..).zip(&bytes) {
            self.memory
                .write(LINK_IN + at as usize % LINK_BYTES, &[*byte])?;
        }
        talk.sent = talk.sent.wrapping_add(count as u32);
        if count > 0 {
            self.memory.set_word(LINK_IN_WRITTEN, talk.sent)?;
        }
        Ok(bytes)
    }

    /// Reads what the firmware has shown, which must be what its twin has.
    pub(super) fn receive(&mut self, expected: &[u8]) -> Result<()> {
        let talk = &mut self.talk;
        let shown = self.memory.word(LINK_OUT_SHOWN)?;
        let mut bytes = Vec::new();
        while talk.read != shown {
            let mut byte = [0];
            let at = LINK_OUT + talk.read as usize % LINK_BYTES;
            self.memory.read(at, &mut byte)?;
            bytes.push(byte[0]);
            talk.read = talk.read.wrapping_add(1);
        }
        ensure!(
            bytes == expected,
            "tick {}: the firmware sends {bytes:02x?}, its twin {expected:02x?}",
            self.tick
        );
        if !talk.is_deaf && talk.taken != talk.read {
            talk.freed = talk.read.wrapping_sub(talk.taken) as usize;
            talk.taken = talk.read;
            self.memory.set_word(LINK_OUT_TAKEN, talk.taken)?;
        }
        self.compared.1 += bytes.len() as u64;
        for byte in bytes {
            let Some(payload) = talk.receiver.push(byte) else {
                continue;
            };
            let message: Message = frame::decode(payload)
                .map_err(|error| anyhow!("the firmware sends what cannot be read: {error:?}"))?;
            if let Message::Response(response) = message {
                talk.answer = Some(response);
            }
        }
        Ok(())
    }
}
