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
mod inject;
mod maintenance;
mod motion;
mod observe;
mod opened;
mod recorder;
mod settings;
mod statistics;
mod status;
mod stream;
mod transmit_buffer;

use crate::app::wire::Translated;
use heapless::String;

use self::deferred::{Deferred, Work};
use self::opened::{OpenInjection, OpenStream};
use self::recorder::Recorder;
use self::transmit_buffer::TransmitBuffer;
use super::queues::ServerEnds;
use super::{Axis, Snapshot, TimingStatistics};
use crate::app::log_ring::{LogRing, TakeLog};
use crate::app::telemetry::Packer;
use crate::hal::{Serial, SettingsFlash};
use crate::store::{BUFFER_BYTES, Store};
use quadrant_law::admission::Refusal;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::scalar::Scalar;
use quadrant_link::frame::FrameCounters;
use quadrant_link::message::{
    AxisSet, Body, Event, LOG_PAGE_BYTES, LinkError, LogPage, Message, Notice, NumberType,
    Provenance, Reply, SettingsRequest, text,
};
use quadrant_link::server::LinkServer;
use quadrant_settings::StageSettings;
use quadrant_settings::draft::Draft;

pub use self::statistics::ServerStatistics;

/// Messages that one poll prepares at most.
const MESSAGES_PER_POLL: usize = 4;
/// Events that wait for the host.
const EVENT_ROOM: usize = 8;
/// Bytes of the log that are taken at a time.
const LOG_BYTES: usize = 128;
/// Pieces of the log that are taken at once: more than the reference board's buffer of 1 KiB holds.
const LOG_PIECES: usize = 10;

/// The parts of a server.
pub struct ServerParts<'q, 'a, S: Scalar, F> {
    /// Its side of the queues.
    pub ends: ServerEnds<'q, 'a, S>,
    /// The axis that the control law does not use, in which new settings are built.
    pub back_buffer: &'a mut Axis<S>,
    /// The settings in force.
    pub settings: &'a mut StageSettings,
    /// Memory for settings that are being edited.
    pub draft: &'a mut StageSettings,
    /// True if `draft` holds settings to look at, and not to be in force unasked: a set older than one that is damaged.
    /// Otherwise its content does not matter.
    pub keep_draft: bool,
    /// The origin of the stored settings.
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
    /// Control rates that the board is up to, Hz: the lowest and the highest.
    pub rates_hz: (f64, f64),
    /// The axes whose steps of another control the board counts.
    pub pulse_axes: [bool; 3],
    /// The axes of which the board reads a serial encoder.
    pub serial_axes: [bool; 3],
    /// The number type of the control law.
    pub number: NumberType,
    /// The way to the board's log; none if the link cannot show it.
    pub log: Option<TakeLog>,
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
    draft: Draft<'a>,
    provenance: Provenance,
    store: Store<F>,
    buffer: &'a mut [u8; BUFFER_BYTES],
    stream: Option<OpenStream>,
    injection: Option<OpenInjection>,
    /// The lowest and the highest position of the plan's motions, mm from their start.
    plan_reach_mm: PerAxis<(f64, f64)>,
    request_tick: u32,
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
    rates_hz: (f64, f64),
    pulse_axes: [bool; 3],
    serial_axes: [bool; 3],
    number: NumberType,
    take_log: Option<TakeLog>,
    log: LogRing,
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
    /// Valid settings were stored, which control does not know yet.
    accepted: bool,
}

impl<'q, 'a, S: Scalar, F: SettingsFlash> Server<'q, 'a, S, F> {
    /// Returns a server without a client.
    // Not inlined: its frame is gone when the start goes on.
    #[inline(never)]
    pub fn new(parts: ServerParts<'q, 'a, S, F>) -> Self {
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
            draft: if parts.keep_draft {
                Draft::edited(parts.settings, parts.draft)
            } else {
                Draft::new(parts.settings, parts.draft)
            },
            provenance: parts.provenance,
            store: parts.store,
            buffer: parts.buffer,
            stream: None,
            injection: None,
            plan_reach_mm: PerAxis::splat((0.0, 0.0)),
            request_tick: 0,
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
            rates_hz: parts.rates_hz,
            pulse_axes: parts.pulse_axes,
            serial_axes: parts.serial_axes,
            number: parts.number,
            take_log: parts.log,
            log: LogRing::new(),
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
    pub fn push_event(&mut self, tick: u32, event: Event) {
        if self.events.push_back((tick, event)).is_err() {
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
        self.keep_log(false);
        self.report_homed(seen);
        self.seen = *seen;
        self.timing = timing;
        self.release();
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
                return if serial.has_sent() {
                    Poll::Reboot
                } else {
                    Poll::Continue
                };
            }
            if !(self.conclude() || self.answer() || self.notify()) {
                break;
            }
        }
        self.transmit.flush(serial);
        Poll::Continue
    }

    /// Takes what the board's log has, and returns whether it has one.
    fn keep_log(&mut self, asked: bool) -> bool {
        let Some(take) = self.take_log else {
            return false;
        };
        for _ in 0..LOG_PIECES {
            let mut bytes = [0; LOG_BYTES];
            let count = take(&mut bytes, asked);
            self.log.push(bytes.get(..count).unwrap_or(&[]));
            if count == 0 {
                break;
            }
        }
        true
    }

    /// A page of the log.
    #[inline(never)]
    fn log(&mut self, from: u32) -> Result<Reply, LinkError> {
        if !self.keep_log(true) {
            return Err(LinkError::Unsupported(text(format_args!(
                "this board sends no log over the link"
            ))));
        }
        let mut page = LogPage::default();
        // Cannot fail: that is its capacity.
        let _ = page.bytes.resize_default(LOG_PAGE_BYTES);
        let (first, count) = self.log.read(from, &mut page.bytes);
        page.from = first;
        page.bytes.truncate(count);
        Ok(Reply::Log(page))
    }

    /// Reports the axes that were homed since the last poll.
    fn report_homed(&mut self, seen: &Snapshot<S>) {
        for axis in AxisName::ALL {
            if seen.view.homed[index(axis)] && !self.seen.view.homed[index(axis)] {
                self.push_event(seen.tick, Event::Homed(Translated::translated(axis)));
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
            self.request_tick = self.seen.tick;
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
        if self.seen.view.brake_moves && (body.may_move() || waits) {
            return Err(busy(format_args!("{}", Refusal::BrakeMoves.as_str())));
        }
        match body {
            Body::Hello => Ok(Reply::Identity(self.identity())),
            Body::Status => Ok(Reply::Status(self.status())),
            Body::Fault => Ok(Reply::Fault(self.fault())),
            Body::Inputs => Ok(Reply::Inputs(self.inputs())),
            Body::Learning => Ok(Reply::Learning(self.learning())),
            Body::Log { from } => self.log(from),
            Body::Stream(request) => self.serve_stream(request),
            Body::Inject(request) => self.serve_inject(request),
            Body::Settings(request) => self.serve_settings(request),
            Body::Telemetry(request) => self.serve_telemetry(request),
            Body::Capture(request) => self.serve_capture(request),
            Body::Reboot => self.defer(Work::Restart),
            Body::SetPlan(plan) => self.set_plan(plan),
            Body::Move {
                axis,
                target_mm,
                velocity_mm_s,
            } => self.start_move(Translated::translated(axis), target_mm, velocity_mm_s),
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

/// The index of an axis in arrays.
const fn index(axis: AxisName) -> usize {
    axis as usize
}
