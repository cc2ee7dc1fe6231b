//! The slow half: answers a host's requests, and hands what they ask for to the control interrupt.
//!
//! [`Server::poll`] runs in the lowest task, about once a millisecond. Every request gets one answer, and the next one is
//! not read before that answer is on its way: a host that asks too fast waits, and nothing grows. A request that takes
//! long (settings are built, flash is written) holds up the link alone.

mod inject;
mod motion;
mod observe;
mod outbox;
mod settings;
mod status;
mod stream;
mod vitals;

use embedded_storage::nor_flash::NorFlash;
use heapless::String;

use self::inject::OpenInjection;
use self::observe::Recorder;
use self::outbox::Outbox;
use self::stream::OpenStream;
use super::queues::ServerEnds;
use super::{Axis, Meters, Snapshot};
use crate::app::supervisor;
use crate::hal::Serial;
use crate::law::axis::CourseMode;
use crate::law::safety::AxisName;
use crate::law::scalar::Scalar;
use crate::law::telemetry::Packer;
use crate::link::frame::FrameCounters;
use crate::link::message::{
    AxisSet, Body, Event, LinkError, Message, Notice, NumberType, Provenance, Reply, text,
};
use crate::link::port::Port;
use crate::settings::StageSettings;
use crate::settings::draft::Draft;
use crate::store::{BUFFER_BYTES, Store};

pub use self::vitals::Vitals;

/// Bytes that are taken from the port at a time.
const INBOX_BYTES: usize = 64;
/// Messages that one poll prepares at most.
const MESSAGES_PER_POLL: usize = 4;
/// Events that wait for the host.
const EVENT_ROOM: usize = 8;
/// Ticks without a good frame after which a host that streams counts as lost: 0.5 s at 10 kHz.
const LINK_PATIENCE_TICKS: u32 = 5_000;

/// What a server is made of.
pub struct ServerParts<'q, 'a, S: Scalar, F> {
    /// Its side of the queues.
    pub ends: ServerEnds<'q, 'a, S>,
    /// The axis that the control law does not use, where new settings are built.
    pub spare: &'a mut Axis<S>,
    /// The settings in force.
    pub settings: &'a mut StageSettings,
    /// Room for settings that are being edited; what it holds does not matter.
    pub draft: &'a mut StageSettings,
    /// Where the settings in force come from.
    pub provenance: Provenance,
    /// The memory for settings.
    pub store: Store<F>,
    /// Room for a set of settings on its way to the store.
    pub buffer: &'a mut [u8; BUFFER_BYTES],
    /// Room for a capture.
    pub capture: &'a mut [u32],
    /// The board's name.
    pub board: &'static str,
    /// Rate of the timer that measures ticks, Hz.
    pub cycle_hz: u32,
    /// What the control law computes with.
    pub number: NumberType,
}

/// What is to be done after a poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum After {
    /// Go on.
    GoOn,
    /// Start afresh, as a host has asked; its answer has been sent.
    Reboot,
}

/// The slow half.
pub struct Server<'q, 'a, S: Scalar, F> {
    ends: ServerEnds<'q, 'a, S>,
    port: Port,
    /// What the port had seen before the byte that is being served.
    frames: FrameCounters,
    inbox: heapless::Deque<u8, INBOX_BYTES>,
    outbox: Outbox,
    seen: Snapshot<S>,
    meters: Meters,
    /// Axes whose new settings are not built yet.
    pending: AxisSet,
    spare: Option<&'a mut Axis<S>>,
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
    /// A server that nobody has spoken to.
    // Not inlined: its frame is gone when the start goes on.
    #[inline(never)]
    pub fn new(parts: ServerParts<'q, 'a, S, F>) -> Self {
        let mut server = Self {
            ends: parts.ends,
            port: Port::new(),
            frames: FrameCounters::default(),
            inbox: heapless::Deque::new(),
            outbox: Outbox::new(),
            seen: Snapshot::default(),
            meters: Meters::default(),
            pending: AxisSet::NONE,
            spare: Some(parts.spare),
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
        server.tell(0, Event::Started(text(format_args!("version {version}"))));
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

    /// Tells the host, if there is one, that something happened at a tick.
    pub fn tell(&mut self, tick: u32, event: Event) {
        if self.events.push_back((tick, event)).is_err() {
            self.dropped_events = self.dropped_events.wrapping_add(1);
        }
    }

    /// The same for what the supervising task found.
    pub fn tell_of(&mut self, tick: u32, event: supervisor::Event) {
        self.tell(tick, event.into());
    }

    /// Whether the axes do what a host must be there for (set points, a jog, an injected voltage), and it has fallen silent.
    pub fn link_lost(&self) -> bool {
        let needed = self.stream.is_some()
            || self.is_injecting()
            || self.seen.view.modes.contains(&CourseMode::Jog);
        needed && self.seen.tick.wrapping_sub(self.heard_tick) > LINK_PATIENCE_TICKS
    }

    /// Takes and sends what the port allows, and goes on with what takes longer. `seen` is the latest snapshot.
    pub fn poll(&mut self, serial: &mut impl Serial, seen: &Snapshot<S>, meters: Meters) -> After {
        self.tell_homed(seen);
        self.seen = *seen;
        self.seen.view.commissioned = self.commissioned;
        self.meters = meters;
        self.arm_at_start();
        self.build_pending();
        self.collect_capture();
        self.follow_stream();
        self.follow_injection();
        for _ in 0..MESSAGES_PER_POLL {
            if !self.outbox.flush(serial) {
                return After::GoOn;
            }
            if self.reboot {
                return After::Reboot;
            }
            if !(self.answer(serial) || self.notify()) {
                break;
            }
        }
        self.outbox.flush(serial);
        After::GoOn
    }

    /// Tells of the axes that have found their home position since the last poll.
    fn tell_homed(&mut self, seen: &Snapshot<S>) {
        for axis in AxisName::ALL {
            if seen.view.homed[index(axis)] && !self.seen.view.homed[index(axis)] {
                self.tell(seen.tick, Event::Homed(axis));
            }
        }
    }

    /// Reads until a request is complete, and prepares its answer; says whether there is one.
    fn answer(&mut self, serial: &mut impl Serial) -> bool {
        loop {
            if self.inbox.is_empty() {
                let mut bytes = [0; INBOX_BYTES];
                let count = serial.read(&mut bytes);
                self.inbox.extend(bytes.iter().take(count).copied());
            }
            while let Some(byte) = self.inbox.pop_front() {
                // The port is taken out while it hands the request over, so that the server can serve it.
                let mut port = core::mem::take(&mut self.port);
                self.frames = port.counters();
                let response = port.push(byte, |body| self.serve(body));
                self.port = port;
                if let Some(response) = response {
                    self.heard_tick = self.seen.tick;
                    self.outbox.fill(&Message::Response(response));
                    return true;
                }
            }
            if self.inbox.is_empty() {
                return false;
            }
        }
    }

    /// Prepares what nobody has asked for; says whether there is something.
    fn notify(&mut self) -> bool {
        if !self.port.is_greeted() {
            return false;
        }
        if let Some((tick, event)) = self.events.pop_front() {
            self.event_number = self.event_number.wrapping_add(1);
            self.outbox.fill(&Message::Notice(Notice::Event {
                sequence: self.event_number,
                tick,
                event,
            }));
            return true;
        }
        match self.next_block() {
            Some(block) => {
                self.outbox.fill(&Message::Notice(Notice::Telemetry(block)));
                true
            }
            None => false,
        }
    }

    /// Does what a request asks for.
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
            Body::SetPlan(plan) => self.set_plan(&plan),
            Body::Move {
                axis,
                target_mm,
                velocity_mm_s,
            } => self.start_move(axis, target_mm, velocity_mm_s),
            other => self.serve_command(other),
        }
    }

    /// Starts afresh, unless that would let go of moving axes.
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

/// A refusal in words.
fn refused(reason: core::fmt::Arguments<'_>) -> LinkError {
    LinkError::Refused(text(reason))
}

/// A value that is not allowed, in words.
fn invalid(reason: core::fmt::Arguments<'_>) -> LinkError {
    LinkError::Invalid(text(reason))
}

/// Something that has to wait, in words.
fn busy(reason: core::fmt::Arguments<'_>) -> LinkError {
    LinkError::Busy(text(reason))
}

/// The place of an axis in arrays.
const fn index(axis: AxisName) -> usize {
    axis as usize
}
