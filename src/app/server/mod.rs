//! The slow half: answers a host's requests, and passes commands, motions and settings to the control interrupt.
//!
//! [`Server::poll`] runs in the lowest task, about once a millisecond. Every request gets one answer, and the next one is
//! not read before that answer is on its way: a host that asks too fast waits, and nothing grows. A request that takes
//! long (settings are built, flash is written) holds up the link alone, and neither `Stop` nor `Disable`, which the
//! [`Intake`](super::Intake) finds by itself.
//!
//! No request is served before control has taken every order and all settings that came of the ones before it and a snapshot
//! says so: each is judged on a state that knows of them all. What must not be overtaken by anything else either, such as the operator's
//! button, is decided by control, and answered when it has ([`Deferred`]).

mod deferred;
mod host_axes;
mod inject;
mod maintenance;
mod motion;
mod observe;
mod opened;
mod own_settings;
mod recorder;
mod statistics;
mod status;
mod stream;
mod transmit_buffer;

use heapless::String;

use self::deferred::{Deferred, Work};
use self::opened::{OpenInjection, OpenStream};
use self::recorder::Recorder;
use self::transmit_buffer::TransmitBuffer;
use super::queues::ServerEnds;
use super::{Axis, Snapshot, TimingStatistics};
use crate::app::telemetry::Packer;
use crate::hal::Serial;
use crate::law::admission::Refusal;
use crate::law::axes::{AxisName, PerAxis};
use crate::law::scalar::Scalar;
use crate::settings::StageBounds;
use quadrant_link::frame::FrameCounters;
use quadrant_link::message::{
    AxisSet, Body, Event, LinkError, LoadHeader, LoadRequest, Message, Notice, NumberType,
    Provenance, Reply, SettingsRequest, text,
};
use quadrant_link::server::LinkServer;

pub use self::host_axes::{HostAxes, fingerprint};
pub use self::own_settings::{OwnSettings, OwnSettingsParts};
pub use self::statistics::ServerStatistics;

/// Messages that one poll prepares at most.
const MESSAGES_PER_POLL: usize = 4;
/// Events that wait for the host.
const EVENT_ROOM: usize = 8;

/// The parts of a server.
pub struct ServerParts<'q, 'a, S: Scalar, O> {
    /// Its side of the queues.
    pub ends: ServerEnds<'q, 'a, S>,
    /// The axis that the control law does not use, in which the next one is made.
    pub back_buffer: &'a mut Axis<S>,
    /// The source of the axes.
    pub source: O,
    /// Memory for a capture.
    pub capture: &'a mut [u32],
    /// The board's name.
    pub board: &'static str,
    /// Rate of the timer that measures ticks, Hz.
    pub cycle_hz: u32,
    /// The number type of the control law.
    pub number: NumberType,
}

/// The source of a server's axes: settings of its own, or a host that has built them.
pub trait AxisSource<'a, S: Scalar>: Sized {
    /// Control rate, Hz.
    fn rate_hz(&self) -> f64;

    /// The bounds of the motions in force.
    fn bounds(&self) -> StageBounds;

    /// The refusal of everything that needs axes, if there are none.
    fn refusal(&self) -> Option<Refusal> {
        None
    }

    /// Serves a request about settings.
    ///
    /// # Errors
    /// The request is refused.
    fn serve_settings(
        server: &mut Server<'_, 'a, S, Self>,
        request: SettingsRequest,
    ) -> Result<Reply, LinkError>;

    /// Stores the draft while control keeps the outputs off.
    ///
    /// # Errors
    /// It is not stored.
    fn store(
        _server: &mut Server<'_, 'a, S, Self>,
        _provenance: Provenance,
    ) -> Result<Reply, LinkError> {
        Err(unsupported("store"))
    }

    /// Serves a request to load axes.
    ///
    /// # Errors
    /// The request is refused.
    fn serve_load(
        _server: &mut Server<'_, 'a, S, Self>,
        _request: LoadRequest,
    ) -> Result<Reply, LinkError> {
        Err(unsupported("load"))
    }

    /// Begins a set of axes, once control keeps the outputs off.
    ///
    /// # Errors
    /// The set is refused.
    fn begin_load(
        _server: &mut Server<'_, 'a, S, Self>,
        _header: LoadHeader,
    ) -> Result<Reply, LinkError> {
        Err(unsupported("load"))
    }

    /// Goes on with an exchange of axes. Once a poll.
    fn exchange(server: &mut Server<'_, 'a, S, Self>);
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
pub struct Server<'q, 'a, S: Scalar, O> {
    ends: ServerEnds<'q, 'a, S>,
    link: LinkServer,
    /// Counts of the link before the byte that is being served.
    frames: FrameCounters,
    transmit: TransmitBuffer,
    seen: Snapshot<S>,
    timing: TimingStatistics,
    /// Axes whose new settings are not built yet.
    pending: AxisSet,
    /// Axes that the settings applied last have changed.
    changed: AxisSet,
    /// Safety depends on a setting in which they differ.
    needs_disabled: bool,
    /// Axes that are homed in another way by the settings applied last.
    new_origins: PerAxis<bool>,
    back_buffer: Option<&'a mut Axis<S>>,
    source: O,
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
    /// Orders sent to control so far; wraps.
    orders: u16,
    /// Axes sent to control so far; wraps.
    exchanges: u16,
    /// Urgent requests served so far, as far as is known; wraps.
    urgent: u32,
    deferred: Option<Deferred>,
    /// Control keeps the outputs off for this server.
    locked: bool,
    /// Valid settings were stored, which control has not been told yet.
    accepted: bool,
}

impl<'q, 'a, S: Scalar, O: AxisSource<'a, S>> Server<'q, 'a, S, O> {
    /// Returns a server without a client.
    // Not inlined: its frame is gone when the start goes on.
    #[inline(never)]
    pub fn new(parts: ServerParts<'q, 'a, S, O>) -> Self {
        let mut server = Self {
            ends: parts.ends,
            link: LinkServer::new(),
            frames: FrameCounters::default(),
            transmit: TransmitBuffer::new(),
            seen: Snapshot::default(),
            timing: TimingStatistics::default(),
            pending: AxisSet::NONE,
            changed: AxisSet::NONE,
            needs_disabled: false,
            new_origins: PerAxis::splat(false),
            back_buffer: Some(parts.back_buffer),
            source: parts.source,
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
            orders: 0,
            exchanges: 0,
            urgent: 0,
            deferred: None,
            locked: false,
            accepted: false,
        };
        let mut version = String::<32>::new();
        let _ = version.push_str(env!("CARGO_PKG_VERSION"));
        server.push_event(0, Event::Started(text(format_args!("version {version}"))));
        server
    }

    /// Queues an event of a tick for the host; counts it as dropped if the queue is full.
    pub fn push_event(&mut self, tick: u32, event: impl Into<Event>) {
        if self.events.push_back((tick, event.into())).is_err() {
            self.dropped_events = self.dropped_events.wrapping_add(1);
        }
    }

    /// Takes what the intake has received, sends what the port allows, and goes on with what takes longer. `seen` is the
    /// latest snapshot.
    pub fn poll(
        &mut self,
        serial: &mut impl Serial,
        seen: &Snapshot<S>,
        timing: TimingStatistics,
    ) -> Poll {
        self.report_homed(seen);
        self.seen = *seen;
        self.timing = timing;
        self.release();
        self.arm_at_start();
        O::exchange(self);
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
            if !(self.conclude() || self.answer() || self.notify()) {
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

    /// Reads until a request is complete, and prepares its answer; returns true if there is one. Reads nothing while an
    /// earlier request waits for control.
    fn answer(&mut self) -> bool {
        while self.deferred.is_none() && !self.locked && self.is_settled() {
            let urgent = self.ends.urgent();
            let Some(byte) = self.ends.bytes.dequeue() else {
                // All that came before the last of them is served.
                self.urgent = urgent;
                return false;
            };
            // The link is taken out while it passes the request on, so that the server can serve it.
            let mut link = core::mem::take(&mut self.link);
            self.frames = link.counters();
            let response = link.push(byte, |body| self.serve(body));
            self.link = link;
            let Some(response) = response else {
                continue;
            };
            self.heard_tick = self.seen.tick;
            if let Some(deferred) = &mut self.deferred {
                deferred.id = response.id;
                return false;
            }
            self.transmit.fill(&Message::Response(response));
            return true;
        }
        false
    }

    /// True if control has taken every order and every axis that was built, and the snapshot knows what came of them. Axes that
    /// wait until the outputs are off are waited for no longer than the outputs stay off.
    fn is_settled(&self) -> bool {
        let held_up = self.needs_disabled && self.seen.view.safety.drives();
        self.seen.orders == self.orders && (held_up || !self.is_exchanging())
    }

    /// True while control has yet to take an axis with settings that were applied.
    fn is_exchanging(&self) -> bool {
        !self.pending.is_empty() || self.seen.exchanges != self.exchanges
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
        if matches!(body, Body::Stop | Body::Disable) {
            self.urgent = self.urgent.wrapping_add(1);
        } else if body.may_move() {
            self.check_not_stopped()?;
        }
        let waits = matches!(
            body,
            Body::Settings(SettingsRequest::Apply | SettingsRequest::Store(_)) | Body::Reboot
        );
        let needs_axes = body.may_move() || matches!(body, Body::SetPlan(_) | Body::Spindle { .. });
        if needs_axes && let Some(refusal) = self.source.refusal() {
            return Err(refused(format_args!("{}", refusal.as_str())));
        }
        if self.seen.view.brake_moves && (body.may_move() || waits) {
            return Err(busy(format_args!("{}", Refusal::BrakeMoves.as_str())));
        }
        match body {
            Body::Hello => Ok(Reply::Identity(self.identity())),
            Body::Status => Ok(Reply::Status(self.status())),
            Body::Fault => Ok(Reply::Fault(self.fault())),
            Body::Inputs => Ok(Reply::Inputs(self.inputs())),
            Body::Learning => Ok(Reply::Learning(self.learning())),
            Body::Stream(request) => self.serve_stream(request),
            Body::Inject(request) => self.serve_inject(request),
            Body::Settings(request) => O::serve_settings(self, request),
            Body::Load(request) => O::serve_load(self, request),
            Body::Telemetry(request) => self.serve_telemetry(request),
            Body::Capture(request) => self.serve_capture(request),
            Body::Reboot => self.defer(Work::Restart),
            Body::SetPlan(plan) => self.set_plan(plan),
            Body::Move {
                axis,
                target_mm,
                velocity_mm_s,
            } => self.start_move(axis.into(), target_mm, velocity_mm_s),
            Body::Spindle { rpm } => self.set_spindle(rpm),
            other => self.serve_command(other),
        }
    }

    /// Checks that nobody has asked to stop or to disable since the request that is being served.
    fn check_not_stopped(&self) -> Result<(), LinkError> {
        if self.urgent == self.ends.urgent() {
            return Ok(());
        }
        Err(refused(format_args!(
            "a later request to stop or to disable has been acted on; ask again"
        )))
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

/// Returns the error of a request that this firmware does not serve.
fn unsupported(name: &str) -> LinkError {
    LinkError::Unsupported(text(format_args!("{name}")))
}

/// The index of an axis in arrays.
const fn index(axis: AxisName) -> usize {
    axis as usize
}
