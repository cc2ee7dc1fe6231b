//! The link's bytes on their way to the server: received in the supervising task, where no request can delay another.

use super::queues::IntakeEnds;
use crate::hal::Serial;
use quadrant_law::command::Command;
use quadrant_link::watch::{LinkWatch, Seen};

/// Bytes that are taken from the port in a run at most: the line carries 92 in a millisecond.
const RUN_BYTES: usize = 256;
/// Bytes that are taken from the port at a time.
const CHUNK_BYTES: usize = 64;

/// The result of one run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Received {
    /// A command that does not wait for the server: to stop, or to disable, the stronger of them.
    pub urgent: Option<Command>,
}

/// Receives the link's bytes and passes them on to the server. What it need not wait for, it finds by itself: `Stop` and
/// `Disable`, and the proof that the host is there.
pub struct Intake<'q> {
    ends: IntakeEnds<'q>,
    watch: LinkWatch,
    frames: u32,
    lost: u32,
}

impl<'q> Intake<'q> {
    /// Returns the intake before the first byte.
    pub const fn new(ends: IntakeEnds<'q>) -> Self {
        Self {
            ends,
            watch: LinkWatch::new(),
            frames: 0,
            lost: 0,
        }
    }

    /// Takes what has arrived. Once a run of the supervising task, before everything else.
    pub fn run(&mut self, serial: &mut impl Serial) -> Received {
        let mut received = Received::default();
        for _ in 0..RUN_BYTES / CHUNK_BYTES {
            let mut chunk = [0; CHUNK_BYTES];
            let count = serial.read(&mut chunk);
            for &byte in chunk.iter().take(count) {
                self.take(byte, &mut received);
            }
            if count < CHUNK_BYTES {
                break;
            }
        }
        received
    }

    fn take(&mut self, byte: u8, received: &mut Received) {
        // A server that is late loses whole frames, by their checksum; it has the room of two.
        if self.ends.bytes.enqueue(byte).is_err() {
            self.lost = self.lost.wrapping_add(1);
        }
        let urgent = match self.watch.push(byte) {
            None => return,
            Some(Seen::Other) => None,
            Some(Seen::Stop) => Some(Command::Stop),
            Some(Seen::Disable) => Some(Command::Disable),
        };
        self.frames = self.frames.wrapping_add(1);
        if urgent.is_some() {
            self.ends.count_urgent();
        }
        if received.urgent != Some(Command::Disable) {
            received.urgent = urgent.or(received.urgent);
        }
    }

    /// Drops the requests of the operator that wait when a host's `Stop` or `Disable` has come: what was asked for before it does
    /// not start after it. Returns the command to act on, which is `Disable` if the operator has asked for that.
    pub fn overtake(urgent: Command, requests: impl Iterator<Item = Command>) -> Command {
        requests.fold(urgent, |strongest, request| match request {
            Command::Disable => request,
            _ => strongest,
        })
    }

    /// Takes note of a command of the operator's that is on its way to control: what a host asked for before a `Stop` or
    /// `Disable`, and the server has not read yet, does not start after it either.
    pub fn note(&mut self, command: Command) {
        if matches!(command, Command::Stop | Command::Disable) {
            self.ends.count_urgent();
        }
    }

    /// Number of valid requests so far, for [`Control::note_requests`](super::Control::note_requests).
    pub const fn frames(&self) -> u32 {
        self.frames
    }

    /// Number of bytes that the server was too late for.
    pub const fn lost(&self) -> u32 {
        self.lost
    }
}
