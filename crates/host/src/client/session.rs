//! The client's end of the link: requests and their answers, and the notices between them.

use std::collections::VecDeque;
use std::io;
use std::time::{Duration, Instant};

use quadrant::app::Translated;
use quadrant_law::safety::FaultCode;
use quadrant_link::frame::{self, DELIMITER, DecodeError, FRAME_BYTES, Receiver};
use quadrant_link::message::{
    AxisName, Body, Event, FaultReport, Identity, Inputs, Learning, LinkError, LogPage, Message,
    Notice, Reply, Request, SettingsRequest, Status,
};
use quadrant_link::message::{MachineState, TelemetryBlock};

use super::error::ClientError;
use super::flat::{flatten_answer, flatten_notice};
use super::interrupt::Interrupt;
use super::timeout::{ANSWER, BUSY, BUSY_PAUSE, Idempotency, answer_timeout, idempotency};
use crate::machine::{PASSED_ON, SimulatedIo, Transport, VIEWER_IDS, encoded};

/// Notices that are kept until someone asks for them; of more, the oldest are dropped.
const MOST_NOTICES: usize = 1 << 14;

/// Longest silence of a host that has started a motion: less than half of the machine's time-out.
const ALIVE: Duration = Duration::from_millis(200);

/// Longest silence of a viewer of a machine that another program holds.
const VIEWING: Duration = Duration::from_secs(1);
/// Time in which notices that have come are read.
const TAKING: Duration = Duration::from_millis(1);

/// Time in which the axes come to rest after an interruption, before the outputs are disabled.
const STOPPING: Duration = Duration::from_secs(10);
/// Time between two looks at them.
const STOPPING_LOOK: Duration = Duration::from_millis(20);

/// Time for a restart.
const RESTART: Duration = Duration::from_secs(10);
/// Pause before the machine is asked again.
const RESTART_PAUSE: Duration = Duration::from_millis(50);

/// Times that a request which may be repeated is made before the machine counts as silent.
const ATTEMPTS: u32 = 4;

/// A fault that the machine has reported of its own accord.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ReportedFault {
    code: u8,
    axis: Option<AxisName>,
    tick: u32,
}

/// A session with a machine.
pub struct Client {
    transport: Box<dyn Transport>,
    receiver: Receiver,
    identity: Option<Identity>,
    next_id: u16,
    /// Time of the last request.
    asked: Duration,
    /// Time of the last look for others, by the connection's clock and by that of this computer: a simulated machine's time may
    /// stand.
    looked: (Duration, Instant),
    /// A motion may be under way, which the machine ends when its host falls silent.
    moves: bool,
    interrupt: Interrupt,
    /// State of the axes since an interruption: nothing starts until [`Client::resume`].
    interrupted: Option<&'static str>,
    /// The interruption is being acted on.
    stopping: bool,
    /// The last fault that the machine has reported, and how many there were.
    reported: (Option<ReportedFault>, u32),
    /// Number of them that have been acted on: before the last motion began, or as the error of what was waited for.
    acted_on: u32,
    notices: VecDeque<Notice>,
    dropped_notices: u64,
}

impl Client {
    /// Opens a session.
    ///
    /// # Errors
    /// A machine that is silent or of another release.
    pub fn open(transport: impl Transport + 'static) -> Result<Self, ClientError> {
        let mut client = Self {
            transport: Box::new(transport),
            receiver: Receiver::new(),
            identity: None,
            next_id: 1,
            asked: Duration::ZERO,
            looked: (Duration::ZERO, Instant::now()),
            moves: false,
            interrupt: Interrupt::default(),
            interrupted: None,
            stopping: false,
            reported: (None, 0),
            acted_on: 0,
            notices: VecDeque::new(),
            dropped_notices: 0,
        };
        // Ends what the other end takes for a frame's beginning.
        client.send(&[DELIMITER])?;
        client.greet()?;
        if client.transport.is_shared() {
            client.look()?;
        }
        Ok(client)
    }

    /// Returns the machine's identity, from the last greeting.
    ///
    /// # Panics
    /// Never: a session is open.
    pub fn identity(&self) -> &Identity {
        self.identity.as_ref().expect("a session is open")
    }

    /// Time by the connection's clock: the machine's time, if it is a simulated one.
    pub fn now(&self) -> Duration {
        self.transport.now()
    }

    /// Returns the other end, for messages.
    pub fn endpoint(&self) -> String {
        self.transport.endpoint()
    }

    /// Inputs, supply and log of the machine, if it is not a real one.
    pub fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        self.transport.simulated_io()
    }

    /// The handle by which the session is interrupted, such as by a signal's handler. Wherever it waits for the machine next,
    /// the axes stop, what was under way ends with [`ClientError::Interrupted`], and nothing is started until
    /// [`resume`](Self::resume).
    pub fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }

    /// True if an interruption was acted on since the last [`resume`](Self::resume).
    pub const fn is_interrupted(&self) -> bool {
        self.interrupted.is_some()
    }

    /// Forgets an interruption: a person has given another command.
    pub fn resume(&mut self) {
        self.interrupted = None;
        self.interrupt.forget();
    }

    /// Asks, and waits for the answer. A request that may be made twice is made again if none comes, and every request but one that
    /// enables the outputs or starts a motion for two seconds if the machine is busy.
    ///
    /// # Errors
    /// No answer, a refusal, or a machine that has restarted.
    pub fn request(&mut self, body: Body) -> Result<Reply, ClientError> {
        let what = body.name();
        let idempotency = idempotency(&body);
        // Settings that were in force before are to come back.
        let applies = matches!(body, Body::Settings(SettingsRequest::Apply));
        if let Some(done) = self.interrupted
            && idempotency == Idempotency::NotIdempotent
            && !applies
        {
            return Err(ClientError::Interrupted { done });
        }
        let busy_until = self.now() + BUSY;
        loop {
            match self.ask(&body)? {
                Ok(reply) => return Ok(reply),
                // Nothing was done. Motions are asked for by a person, each time.
                Err(LinkError::Busy(_))
                    if !(body.may_move() && idempotency == Idempotency::NotIdempotent)
                        && self.now() < busy_until =>
                {
                    self.wait(BUSY_PAUSE)?;
                }
                Err(LinkError::NoHello) if !matches!(body, Body::Hello) => {
                    self.greet()?;
                    if idempotency != Idempotency::Query {
                        return Err(ClientError::Restarted { what });
                    }
                }
                Err(LinkError::Version { mine: theirs, .. }) => return Err(self.version(theirs)),
                Err(source) => return Err(ClientError::Refused { what, source }),
            }
        }
    }

    /// Asks for something that is only to be done.
    ///
    /// # Errors
    /// As [`request`](Self::request).
    pub fn order(&mut self, body: Body) -> Result<(), ClientError> {
        let what = body.name();
        match self.request(body)? {
            Reply::Done => Ok(()),
            other => Err(self.unexpected(what, &other)),
        }
    }

    /// Reads the machine's status.
    ///
    /// # Errors
    /// As [`request`](Self::request).
    pub fn status(&mut self) -> Result<Status, ClientError> {
        match self.request(Body::Status)? {
            Reply::Status(status) => Ok(status),
            other => Err(self.unexpected("status", &other)),
        }
    }

    /// Reads the machine's digital inputs.
    ///
    /// # Errors
    /// As [`request`](Self::request).
    pub fn inputs(&mut self) -> Result<Inputs, ClientError> {
        match self.request(Body::Inputs)? {
            Reply::Inputs(inputs) => Ok(inputs),
            other => Err(self.unexpected("inputs", &other)),
        }
    }

    /// Reads what the axes have learnt.
    ///
    /// # Errors
    /// As [`request`](Self::request).
    pub fn learning(&mut self) -> Result<Learning, ClientError> {
        match self.request(Body::Learning)? {
            Reply::Learning(learning) => Ok(learning),
            other => Err(self.unexpected("learning", &other)),
        }
    }

    /// A page of the log, from the byte of this number on.
    ///
    /// # Errors
    /// A board without one; or as [`request`](Self::request).
    pub fn log(&mut self, from: u32) -> Result<LogPage, ClientError> {
        match self.request(Body::Log { from })? {
            Reply::Log(page) => Ok(page),
            other => Err(self.unexpected("log", &other)),
        }
    }

    /// The latched fault, if there is one.
    ///
    /// # Errors
    /// As [`request`](Self::request).
    pub fn fault(&mut self) -> Result<Option<FaultReport>, ClientError> {
        match self.request(Body::Fault)? {
            Reply::Fault(fault) => Ok(fault),
            other => Err(self.unexpected("fault", &other)),
        }
    }

    /// The next notice, waiting for it at most for `timeout`.
    ///
    /// # Errors
    /// A connection that is broken, or a machine of another release.
    pub fn notice(&mut self, timeout: Duration) -> Result<Option<Notice>, ClientError> {
        let due = self.now() + timeout;
        while self.notices.is_empty() && self.now() < due {
            self.receive(due)?;
        }
        Ok(self.notices.pop_front())
    }

    /// Takes the notices that have come.
    pub fn take_notices(&mut self) -> impl Iterator<Item = Notice> + use<> {
        std::mem::take(&mut self.notices).into_iter()
    }

    /// Takes the blocks of telemetry that have come, and leaves the other notices.
    pub fn take_blocks(&mut self) -> Vec<TelemetryBlock> {
        let mut blocks = Vec::new();
        let mut others = VecDeque::new();
        for notice in self.notices.drain(..) {
            match notice {
                Notice::Telemetry(block) => blocks.push(block),
                other => others.push_back(other),
            }
        }
        self.notices = others;
        blocks
    }

    /// Notices that nobody asked for in time.
    pub const fn dropped_notices(&self) -> u64 {
        self.dropped_notices
    }

    /// Lets time pass, and keeps the notices that come.
    ///
    /// # Errors
    /// As [`notice`](Self::notice).
    pub fn wait(&mut self, time: Duration) -> Result<(), ClientError> {
        let due = self.now() + time;
        while self.now() < due {
            self.keep_alive()?;
            self.receive(due)?;
        }
        Ok(())
    }

    /// True if this session has started a motion that, as far as it knows, is under way.
    pub const fn moves(&self) -> bool {
        self.moves
    }

    /// True if another program holds the machine, and this session looks at it.
    pub fn is_view(&self) -> bool {
        self.transport.is_view()
    }

    /// Lets the machine know that its host is there, if a motion was started and nothing was asked for a while: it stops what
    /// its host has started when that falls silent. Asks for everything that others see, if they may look. A caller that lets time
    /// pass without [`wait`](Self::wait) calls this a few times a second.
    ///
    /// # Errors
    /// As [`request`](Self::request).
    pub fn keep_alive(&mut self) -> Result<(), ClientError> {
        self.act_on_interrupt()?;
        let silent = self.now().saturating_sub(self.asked);
        let status = if self.transport.is_shared() {
            let (looked, at) = self.looked;
            if self.now().saturating_sub(looked) < ALIVE && at.elapsed() < ALIVE {
                return Ok(());
            }
            self.look()?
        } else if self.moves && silent >= ALIVE {
            self.status()?
        } else {
            if self.is_view() {
                if silent >= VIEWING {
                    self.show_alive()?;
                }
                // One whose answers nobody takes is gone for its holder.
                self.receive(self.now() + TAKING)?;
            }
            return Ok(());
        };
        self.moves &= !status.is_at_rest();
        Ok(())
    }

    /// Asks for everything that others see who look at the machine.
    fn look(&mut self) -> Result<Status, ClientError> {
        self.looked = (self.now(), Instant::now());
        self.inputs()?;
        self.learning()?;
        self.fault()?;
        self.status()
    }

    /// Stops the axes if somebody asked for it: once, and the outputs go off when it was asked for again before they are at
    /// rest.
    fn act_on_interrupt(&mut self) -> Result<(), ClientError> {
        if self.stopping {
            return Ok(());
        }
        let requests = self.interrupt.take();
        if requests == 0 {
            return Ok(());
        }
        self.interrupted = Some("the machine may still move");
        self.stopping = true;
        let done = self.stop_for(requests);
        self.stopping = false;
        let done = done?;
        self.interrupted = Some(done);
        Err(ClientError::Interrupted { done })
    }

    fn stop_for(&mut self, mut requests: u32) -> Result<&'static str, ClientError> {
        // What moves there is the part program's.
        if self.identity().board.as_str() == "linuxcnc" && !self.moves {
            return Ok("this program moves nothing; LinuxCNC goes on");
        }
        self.order(Body::Stop)?;
        let due = self.now() + STOPPING;
        loop {
            requests += self.interrupt.take();
            if requests > 1 || self.now() >= due {
                self.order(Body::Disable)?;
                return Ok("the outputs are off");
            }
            self.wait(STOPPING_LOOK)?;
            if self.status()?.is_at_rest() {
                return Ok("the axes have stopped");
            }
        }
    }

    /// An error if a fault is latched: what ended `what`.
    ///
    /// # Errors
    /// The fault; or as [`request`](Self::request).
    pub fn refuse_fault(&mut self, what: &'static str, status: &Status) -> Result<(), ClientError> {
        if status.state != MachineState::Fault {
            return Ok(());
        }
        match self.fault()? {
            Some(fault) => {
                self.act_on_reported();
                Err(ClientError::Fault {
                    what,
                    code: fault.code,
                    name: fault.name.as_str().to_owned(),
                    axis: fault.axis.map(Translated::translated),
                    tick: fault.tick,
                    cause: fault.cause.as_str().to_owned(),
                    remedy: fault.remedy.as_str().to_owned(),
                })
            }
            None => Ok(()),
        }
    }

    /// Counts the faults that the machine has reported as acted on.
    pub(super) const fn act_on_reported(&mut self) {
        self.acted_on = self.reported.1;
    }

    /// An error if the machine has reported a fault that nobody has acted on: latched, or after which the axes braked and hold.
    ///
    /// # Errors
    /// The last of them, as what ended `what`.
    pub(super) fn refuse_reported(&mut self, what: &'static str) -> Result<(), ClientError> {
        match self.reported {
            (Some(ReportedFault { code, axis, tick }), count) if count != self.acted_on => {
                self.act_on_reported();
                let fault = FaultCode::from_number(code);
                Err(ClientError::Fault {
                    what,
                    code,
                    name: fault
                        .map_or("of a later release", FaultCode::name)
                        .to_owned(),
                    axis: axis.map(Translated::translated),
                    tick,
                    cause: fault
                        .map_or("unknown to this program", FaultCode::cause)
                        .to_owned(),
                    remedy: fault
                        .map_or("look at `fault`", FaultCode::remedy)
                        .to_owned(),
                })
            }
            _ => Ok(()),
        }
    }

    /// Greets the machine again after its restart, when it answers.
    ///
    /// # Errors
    /// A machine that is silent for 10 s, or of another release.
    pub fn restarted(&mut self) -> Result<(), ClientError> {
        self.moves = false;
        let due = self.now() + RESTART;
        self.wait(RESTART_PAUSE)?;
        loop {
            match self.greet() {
                Err(ClientError::Silent { .. } | ClientError::Connection { .. })
                    if self.now() < due =>
                {
                    self.wait(RESTART_PAUSE)?;
                }
                other => return other,
            }
        }
    }

    pub(super) fn unexpected(&self, what: &'static str, reply: &Reply) -> ClientError {
        ClientError::Unexpected {
            what,
            endpoint: self.endpoint(),
            answer: reply_name(reply),
        }
    }

    fn greet(&mut self) -> Result<(), ClientError> {
        match self.ask(&Body::Hello)? {
            Ok(Reply::Identity(identity)) => {
                self.identity = Some(identity);
                Ok(())
            }
            Ok(other) => Err(self.unexpected("hello", &other)),
            Err(LinkError::Version { mine: theirs, .. }) => Err(self.version(theirs)),
            Err(source) => Err(ClientError::Refused {
                what: "hello",
                source,
            }),
        }
    }

    /// Makes one request, more than once if it may be and nothing comes back. All attempts have one number, so that a late
    /// answer to the first is an answer.
    fn ask(&mut self, body: &Body) -> Result<Result<Reply, LinkError>, ClientError> {
        let id = self.next_id;
        self.next_id = (self.next_id + 1) % VIEWER_IDS;
        let request = Request {
            id,
            body: body.clone(),
        };
        let bytes = encoded(&request);
        let attempts = match idempotency(body) {
            Idempotency::NotIdempotent => 1,
            Idempotency::Query | Idempotency::Idempotent => ATTEMPTS,
        };
        match body {
            Body::Jog { .. }
            | Body::Run
            | Body::Home(_)
            | Body::Move { .. }
            | Body::Stream(_)
            | Body::Inject(_) => {
                self.moves = true;
                self.act_on_reported();
            }
            Body::Stop | Body::Disable => self.moves = false,
            Body::ResetFault => self.act_on_reported(),
            _ => {}
        }
        let began = self.now();
        self.asked = began;
        for attempt in 0..attempts {
            if attempt > 0 {
                // What the line did to the last one may have begun a frame.
                self.send(&[DELIMITER])?;
            }
            self.send(&bytes)?;
            let timeout = self.answer_timeout(body);
            let due = self.now() + timeout;
            while self.now() < due {
                if let Some(result) = self.receive_for(id, due)? {
                    return Ok(result);
                }
                let silent = self.now().saturating_sub(self.asked);
                if timeout > ALIVE && self.moves && silent >= ALIVE {
                    self.show_alive()?;
                }
            }
        }
        let waited = self.now().saturating_sub(began);
        Err(match attempts {
            1 => ClientError::Unsure {
                what: body.name(),
                endpoint: self.endpoint(),
                waited_ms: waited.as_millis(),
            },
            _ => ClientError::silent(
                body.name(),
                self.endpoint(),
                waited,
                attempts,
                self.transport.remedy(),
            ),
        })
    }

    /// Time for an answer. What one that looks asks of the machine goes through its holder.
    fn answer_timeout(&self, body: &Body) -> Duration {
        match body {
            Body::Stop | Body::Disable if self.is_view() => answer_timeout(body) + PASSED_ON,
            _ => answer_timeout(body),
        }
    }

    /// Reports to the other end that this one is there; nobody waits for what it answers to this.
    fn show_alive(&mut self) -> Result<(), ClientError> {
        self.asked = self.now();
        let request = Request {
            id: self.next_id,
            body: Body::Status,
        };
        self.next_id = (self.next_id + 1) % VIEWER_IDS;
        self.send(&encoded(&request))
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), ClientError> {
        self.transport
            .send(bytes)
            .map_err(|source| self.broken(source))
    }

    fn receive(&mut self, due: Duration) -> Result<(), ClientError> {
        // No request has this number: it is the next one's.
        self.receive_for(self.next_id, due).map(|_| ())
    }

    /// Takes what comes next, until `due` at most: notices are kept, and the answer to request `id` is given.
    fn receive_for(
        &mut self,
        id: u16,
        due: Duration,
    ) -> Result<Option<Result<Reply, LinkError>>, ClientError> {
        self.act_on_interrupt()?;
        let mut buffer = [0; FRAME_BYTES];
        let timeout = due.saturating_sub(self.now()).min(ANSWER);
        let count = self
            .transport
            .receive(&mut buffer, timeout)
            .map_err(|source| self.broken(source))?;
        let mut answer = None;
        for &byte in &buffer[..count] {
            let Some(payload) = self.receiver.push(byte) else {
                continue;
            };
            match frame::decode::<Message>(payload) {
                Ok(Message::Response(mut response)) if response.id == id => {
                    flatten_answer(&mut response.result);
                    answer = Some(response.result);
                }
                // An answer to what was given up, or a second one.
                Ok(Message::Response(_)) => {}
                Ok(Message::Notice(mut notice)) => {
                    flatten_notice(&mut notice);
                    self.keep(notice);
                }
                Err(DecodeError::Version(theirs)) => return Err(self.version(theirs)),
                // A message that a later release of this version has added.
                Err(DecodeError::Malformed) => {}
            }
        }
        Ok(answer)
    }

    fn keep(&mut self, notice: Notice) {
        if let Notice::Event {
            tick,
            event: Event::Fault { code, axis } | Event::Held { code, axis },
            ..
        } = notice
        {
            self.reported = (
                Some(ReportedFault { code, axis, tick }),
                self.reported.1.wrapping_add(1),
            );
        }
        if self.notices.len() == MOST_NOTICES {
            self.notices.pop_front();
            self.dropped_notices += 1;
        }
        self.notices.push_back(notice);
    }

    fn broken(&self, source: io::Error) -> ClientError {
        ClientError::Connection {
            endpoint: self.endpoint(),
            source,
            remedy: self.transport.remedy(),
        }
    }

    fn version(&self, theirs: u8) -> ClientError {
        ClientError::Version {
            endpoint: self.endpoint(),
            theirs,
        }
    }
}

/// Returns the name of a reply.
const fn reply_name(reply: &Reply) -> &'static str {
    match reply {
        Reply::Done => "done",
        Reply::Identity(_) => "an identity",
        Reply::Status(_) => "a status",
        Reply::Fault(_) => "a fault",
        Reply::Stream(_) => "the state of a stream",
        Reply::Value(_) => "a value",
        Reply::Paths(_) => "paths",
        Reply::Applied(_) => "applied settings",
        Reply::Provenance(_) => "a provenance",
        Reply::Telemetry { .. } => "a telemetry selection",
        Reply::Capture(_) => "the state of a capture",
        Reply::Words(_) => "words of a capture",
        Reply::Inject(_) => "the state of an injection",
        Reply::Inputs(_) => "the digital inputs",
        Reply::Learning(_) => "what was learnt",
        Reply::Log(_) => "a page of the log",
    }
}
