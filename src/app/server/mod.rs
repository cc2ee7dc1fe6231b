//! The slow half: answers a host's requests, and passes commands, motions and settings to the control interrupt.
//!
//! [`Server::poll`] runs in the lowest task, about once a millisecond. Every request gets one answer, and the next one is
//! not read before that answer is on its way: a host that asks too fast waits, and nothing grows. A request that takes
//! long (settings are built, flash is written) holds up the link alone.

mod inject;
mod motion;
mod observe;
mod opened;
mod recorder;
mod settings;
mod statistics;
mod status;
mod stream;
mod transmit_buffer;

use embedded_storage::nor_flash::NorFlash;
use heapless::String;

use self::opened::{OpenInjection, OpenStream};
use self::recorder::Recorder;
use self::transmit_buffer::TransmitBuffer;
use super::queues::ServerEnds;
use super::{Axis, Snapshot, TimingStatistics};
use crate::app::telemetry::Packer;
use crate::hal::Serial;
use crate::law::axes::AxisName;
use crate::law::motion::MotionMode;
use crate::law::scalar::Scalar;
use crate::settings::StageSettings;
use crate::settings::draft::Draft;
use crate::store::{BUFFER_BYTES, Store};
use quadrant_link::frame::FrameCounters;
use quadrant_link::message::{
    AxisSet, Body, Event, LinkError, Message, Notice, NumberType, Provenance, Reply, text,
};
use quadrant_link::server::LinkServer;

pub use self::statistics::ServerStatistics;

/// Bytes that are taken from the port at a time.
const RECEIVE_BYTES: usize = 64;
/// Messages that one poll prepares at most.
const MESSAGES_PER_POLL: usize = 4;
/// Events that wait for the host.
const EVENT_ROOM: usize = 8;
/// Ticks without a good frame after which a host that streams counts as lost: 0.5 s at 10 kHz.
const LINK_TIMEOUT_TICKS: u32 = 5_000;

/// The parts of a server.
pub struct ServerParts<'q, 'a, S: Scalar, F> {
    /// Its side of the queues.
    pub ends: ServerEnds<'q, 'a, S>,
    /// The axis that the control law does not use, in which new settings are built.
    pub back_buffer: &'a mut Axis<S>,
    /// The settings in force.
    pub settings: &'a mut StageSettings,
    /// Memory for settings that are being edited; its content does not matter.
    pub draft: &'a mut StageSettings,
    /// The origin of the settings in force.
    pub provenance: Provenance,
    /// The memory for settings.
    pub store: Store<F>,
    /// Buffer for a set of settings on its way to the store.
    pub buffer: &'a mut [u8; BUFFER_BYTES],
    /// Memory for a capture.
    pub capture: &'a mut [u32],
    /// The board's name.
    pub board: &'static str,
    /// Rate of the timer that measures ticks, Hz.
    pub cycle_hz: u32,
    /// The number type of the control law.
    pub number: NumberType,
}

/// The result of a poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Poll {
    /// Polling goes on.
    Continue,
    /// A host has asked for a restart, and its answer has been sent.
    Reboot,
}

/// The slow half: the server of the link.
pub struct Server<'q, 'a, S: Scalar, F> {
    ends: ServerEnds<'q, 'a, S>,
    link: LinkServer,
    /// Counts of the link before the byte that is being served.
    frames: FrameCounters,
    received: heapless::Deque<u8, RECEIVE_BYTES>,
    transmit: TransmitBuffer,
    seen: Snapshot<S>,
    timing: TimingStatistics,
    /// Axes whose new settings are not built yet.
    pending: AxisSet,
    back_buffer: Option<&'a mut Axis<S>>,
    draft: Draft<'a>,
    /// Somebody has given the settings in force.
    commissioned: bool,
    provenance: Provenance,
    store: Store<F>,
    buffer: &'a mut [u8; BUFFER_BYTES],
    stream: Option<OpenStream>,
    injection: Option<OpenInjection>,
    heard_tick: u32,
    packer: Packer,
    generation: u8,
    recorder: Recorder<'a>,
    events: heapless::Deque<(u32, Event), EVENT_ROOM>,
    event_number: u16,
    dropped_events: u32,
    applied: u16,
    stored: u16,
    board: &'static str,
    cycle_hz: u32,
    number: NumberType,
    reboot: bool,
}

impl<'q, 'a, S: Scalar, F: NorFlash> Server<'q, 'a, S, F> {
    /// Returns a server without a client.
    // Not inlined: its frame is gone when the start goes on.
    #[inline(never)]
    pub fn new(parts: ServerParts<'q, 'a, S, F>) -> Self {
        let mut server = Self {
            ends: parts.ends,
            link: LinkServer::new(),
            frames: FrameCounters::default(),
            received: heapless::Deque::new(),
            transmit: TransmitBuffer::new(),
            seen: Snapshot::default(),
            timing: TimingStatistics::default(),
            pending: AxisSet::NONE,
            back_buffer: Some(parts.back_buffer),
            commissioned: parts.settings.is_commissioned(),
            draft: Draft::new(parts.settings, parts.draft),
            provenance: parts.provenance,
            store: parts.store,
            buffer: parts.buffer,
            stream: None,
            injection: None,
            heard_tick: 0,
            packer: Packer::default(),
            generation: 0,
            recorder: Recorder::new(parts.capture),
            events: heapless::Deque::new(),
            event_number: 0,
            dropped_events: 0,
            applied: 0,
            stored: 0,
            board: parts.board,
            cycle_hz: parts.cycle_hz,
            number: parts.number,
            reboot: false,
        };
        let mut version = String::<32>::new();
        let _ = version.push_str(env!("CARGO_PKG_VERSION"));
        server.push_event(0, Event::Started(text(format_args!("version {version}"))));
        server
    }

    /// The memory for settings.
    pub const fn flash(&self) -> &F {
        self.store.flash()
    }

    /// True if the settings in force are not the default ones, on which the outputs are not enabled.
    pub const fn is_commissioned(&self) -> bool {
        self.commissioned
    }

    /// Queues an event of a tick for the host; counts it as dropped if the queue is full.
    pub fn push_event(&mut self, tick: u32, event: impl Into<Event>) {
        if self.events.push_back((tick, event.into())).is_err() {
            self.dropped_events = self.dropped_events.wrapping_add(1);
        }
    }

    /// True if the axes depend on a host (set points, a jog, an injected voltage) that has fallen silent.
    pub fn link_lost(&self) -> bool {
        let needed = self.stream.is_some()
            || self.is_injecting()
            || self.seen.view.modes.contains(&MotionMode::Jog);
        needed && self.seen.tick.wrapping_sub(self.heard_tick) > LINK_TIMEOUT_TICKS
    }

    /// Takes and sends what the port allows, and goes on with what takes longer. `seen` is the latest snapshot.
    pub fn poll(
        &mut self,
        serial: &mut impl Serial,
        seen: &Snapshot<S>,
        timing: TimingStatistics,
    ) -> Poll {
        self.report_homed(seen);
        self.seen = *seen;
        self.seen.view.commissioned = self.commissioned;
        self.timing = timing;
        self.arm_at_start();
        self.build_pending();
        self.collect_capture();
        self.follow_stream();
        self.follow_injection();
        for _ in 0..MESSAGES_PER_POLL {
            if !self.transmit.flush(serial) {
                return Poll::Continue;
            }
            if self.reboot {
                return Poll::Reboot;
            }
            if !(self.answer(serial) || self.notify()) {
                break;
            }
        }
        self.transmit.flush(serial);
        Poll::Continue
    }

    /// Reports the axes that were homed since the last poll.
    fn report_homed(&mut self, seen: &Snapshot<S>) {
        for axis in AxisName::ALL {
            if seen.view.homed[index(axis)] && !self.seen.view.homed[index(axis)] {
                self.push_event(seen.tick, Event::Homed(axis.into()));
            }
        }
    }

    /// Reads until a request is complete, and prepares its answer; returns true if there is one.
    fn answer(&mut self, serial: &mut impl Serial) -> bool {
        loop {
            if self.received.is_empty() {
                let mut bytes = [0; RECEIVE_BYTES];
                let count = serial.read(&mut bytes);
                self.received.extend(bytes.iter().take(count).copied());
            }
            while let Some(byte) = self.received.pop_front() {
                // The link is taken out while it passes the request on, so that the server can serve it.
                let mut link = core::mem::take(&mut self.link);
                self.frames = link.counters();
                let response = link.push(byte, |body| self.serve(body));
                self.link = link;
                if let Some(response) = response {
                    self.heard_tick = self.seen.tick;
                    self.transmit.fill(&Message::Response(response));
                    return true;
                }
            }
            if self.received.is_empty() {
                return false;
            }
        }
    }

    /// Prepares a notice; returns true if there is one.
    fn notify(&mut self) -> bool {
        if !self.link.is_greeted() {
            return false;
        }
        if let Some((tick, event)) = self.events.pop_front() {
            self.event_number = self.event_number.wrapping_add(1);
            self.transmit.fill(&Message::Notice(Notice::Event {
                sequence: self.event_number,
                tick,
                event,
            }));
            return true;
        }
        match self.next_block() {
            Some(block) => {
                self.transmit
                    .fill(&Message::Notice(Notice::Telemetry(block)));
                true
            }
            None => false,
        }
    }

    /// Serves a request.
    #[inline(never)]
    fn serve(&mut self, body: Body) -> Result<Reply, LinkError> {
        match body {
            Body::Hello => Ok(Reply::Identity(self.identity())),
            Body::Status => Ok(Reply::Status(self.status())),
            Body::Fault => Ok(Reply::Fault(self.fault())),
            Body::Stream(request) => self.serve_stream(request),
            Body::Inject(request) => self.serve_inject(request),
            Body::Settings(request) => self.serve_settings(request),
            Body::Telemetry(request) => self.serve_telemetry(request),
            Body::Capture(request) => self.serve_capture(request),
            Body::Reboot => self.restart(),
            Body::SetPlan(plan) => self.set_plan(plan),
            Body::Move {
                axis,
                target_mm,
                velocity_mm_s,
            } => self.start_move(axis.into(), target_mm, velocity_mm_s),
            other => self.serve_command(other),
        }
    }

    /// Prepares a restart, unless the outputs are on.
    fn restart(&mut self) -> Result<Reply, LinkError> {
        if self.seen.view.safety.drives() {
            return Err(refused(format_args!(
                "the outputs are on; disable them before a restart"
            )));
        }
        self.reboot = true;
        Ok(Reply::Done)
    }
}

/// Returns the error of a request that the machine's state does not allow.
fn refused(reason: core::fmt::Arguments<'_>) -> LinkError {
    LinkError::Refused(text(reason))
}

/// Returns the error of a value that is not allowed.
fn invalid(reason: core::fmt::Arguments<'_>) -> LinkError {
    LinkError::Invalid(text(reason))
}

/// Returns the error of a request that may succeed later.
fn busy(reason: core::fmt::Arguments<'_>) -> LinkError {
    LinkError::Busy(text(reason))
}

/// The index of an axis in arrays.
const fn index(axis: AxisName) -> usize {
    axis as usize
}
