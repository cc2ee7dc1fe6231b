//! A machine that this program holds and lets others look at: they see what it receives, and may stop the axes.
//!
//! Viewers speak the link's protocol over a socket, so the same client serves. States are those that the machine has reported to its
//! holder last, as long as they are fresh. Of what viewers ask, nothing but `Stop` and `Disable` reaches the machine, so that a
//! viewer is no host to a motion that needs one; it is answered by the machine, or informed that no answer came.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use quadrant_law::axes::AxisName;
use quadrant_link::frame::{self, DELIMITER, FRAME_BYTES};
use quadrant_link::message::{
    Body, FaultReport, Identity, Inputs, Learning, LinkError, Message, Notice, Reply, Request,
    Status, text,
};
use quadrant_link::server::LinkServer;

use super::simulated_io::SimulatedIo;
use super::stream::or_none;
use super::transport::{Transport, encoded};

/// Numbers of the viewers' requests on their way to the machine begin here; the client gives none of them.
pub const VIEWER_IDS: u16 = 0xFF00;
/// Viewers at a time; a connection beyond them is closed at once.
pub const MOST_VIEWERS: usize = 16;
/// Age from which on a state is not shown as that of now.
const FRESH: Duration = Duration::from_secs(1);
/// Time within which the machine answers what a viewer asked of it, or the viewer learns that it did not.
pub const PASSED_ON: Duration = Duration::from_millis(600);
/// Time in which a new connection sends its token and hello.
const GREETING: Duration = Duration::from_secs(2);
/// Silence of a viewer after which its connection is closed.
const SILENCE: Duration = Duration::from_secs(10);
/// Notices that wait for a viewer; one that is slower misses the newest.
const WAITING: usize = 1000;
/// Time between two looks at what a viewer is to receive, and at what viewers ask for.
const LOOK: Duration = Duration::from_millis(20);
/// Time in which a viewer takes what it is sent; after that it is gone.
const TAKING: Duration = Duration::from_secs(2);
/// Pause after a connection that could not be taken: without it, a system that has no more descriptors is asked in a circle.
const REFUSED_PAUSE: Duration = Duration::from_millis(200);
/// Random bytes of a token.
const TOKEN_BYTES: usize = 16;
/// Longest token that is read, characters.
const TOKEN_CHARS: usize = 2 * TOKEN_BYTES;

/// A transport whose other end others may look at.
pub struct Shared<T> {
    inner: T,
    receiver: frame::Receiver,
    hub: Arc<Hub>,
    address: SocketAddr,
    token: Option<String>,
    /// Viewers' requests that the machine has, by their number.
    asked: BTreeMap<u16, SyncSender<Answer>>,
    next_id: u16,
}

type Answer = Result<Reply, LinkError>;

/// The common ground of holder and viewers.
#[derive(Default)]
struct Hub {
    received: Mutex<Received>,
    /// Requests that wait for the holder; each viewer has one at most.
    errands: Mutex<Vec<Errand>>,
    viewers: AtomicUsize,
}

/// A viewer's request of the machine.
struct Errand {
    viewer: u64,
    body: Body,
    /// Takes the machine's answer. The viewer has gone on if there is no other end.
    answer: SyncSender<Answer>,
}

/// An answer of the machine, and the time at which it came.
struct Known<V>(Option<(V, Instant)>);

impl<V> Default for Known<V> {
    fn default() -> Self {
        Self(None)
    }
}

impl<V: Clone> Known<V> {
    fn set(&mut self, value: V) {
        self.0 = Some((value, Instant::now()));
    }

    /// The value while it is fresh.
    ///
    /// # Errors
    /// Nothing was received yet, or nothing since [`FRESH`]: the age.
    fn fresh(&self) -> Result<V, Option<Duration>> {
        match &self.0 {
            Some((value, since)) if since.elapsed() <= FRESH => Ok(value.clone()),
            Some((_, since)) => Err(Some(since.elapsed())),
            None => Err(None),
        }
    }
}

/// The machine's last answers, and who receives its notices.
#[derive(Default)]
struct Received {
    identity: Option<Identity>,
    status: Known<Status>,
    inputs: Known<Inputs>,
    learning: Known<Learning>,
    fault: Known<Option<FaultReport>>,
    viewers: BTreeMap<u64, SyncSender<Notice>>,
}

impl<T: Transport> Shared<T> {
    /// Lets others look at an address from now on: `host:port`, or a port alone of this computer. One that other computers
    /// reach asks for a [`token`](Self::token).
    ///
    /// # Errors
    /// An address that is none, or that is taken; a system without random numbers.
    pub fn listen(inner: T, address: &str) -> io::Result<Self> {
        let listener = TcpListener::bind(&*addresses(address)?)?;
        let address = listener.local_addr()?;
        let token = match address.ip().is_loopback() {
            true => None,
            false => Some(new_token()?),
        };
        let hub = Arc::new(Hub::default());
        let (of_viewers, asked_for) = (Arc::clone(&hub), token.clone());
        thread::spawn(move || accept(&listener, &of_viewers, asked_for.as_deref()));
        Ok(Self {
            inner,
            receiver: frame::Receiver::new(),
            hub,
            address,
            token,
            asked: BTreeMap::new(),
            next_id: VIEWER_IDS,
        })
    }

    /// The address at which others look.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The token that a viewer has to give; none where this computer alone reaches the address.
    pub fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// Passes on what viewers asked for.
    fn pass_on(&mut self) -> io::Result<()> {
        for Errand { body, answer, .. } in self.hub.take_errands() {
            let id = self.next_id;
            self.next_id = self.next_id.checked_add(1).unwrap_or(VIEWER_IDS);
            self.asked.insert(id, answer);
            self.inner.send(&encoded(&Request { id, body }))?;
        }
        Ok(())
    }

    fn receive(&mut self, message: Message) {
        match message {
            Message::Response(response) => {
                if let Some(viewer) = self.asked.remove(&response.id) {
                    // One that is gone, or has waited long enough, takes nothing.
                    let _ = viewer.try_send(response.result.clone());
                }
                if let Ok(reply) = response.result {
                    self.hub.keep(reply);
                }
            }
            Message::Notice(notice) => self.hub.broadcast(&notice),
        }
    }
}

impl<T: Transport> Transport for Shared<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.pass_on()?;
        self.inner.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let due = self.inner.now() + timeout;
        loop {
            self.pass_on()?;
            // In short pieces, so that no viewer waits for all of it.
            let left = due.saturating_sub(self.inner.now());
            let count = self.inner.receive(buffer, left.min(LOOK))?;
            for &byte in &buffer[..count] {
                if let Some(payload) = self.receiver.push(byte)
                    && let Ok(message) = frame::decode::<Message>(payload)
                {
                    self.receive(message);
                }
            }
            if count > 0 || self.inner.now() >= due {
                return Ok(count);
            }
        }
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }

    fn endpoint(&self) -> String {
        self.inner.endpoint()
    }

    fn remedy(&self) -> &'static str {
        self.inner.remedy()
    }

    fn is_shared(&self) -> bool {
        true
    }

    fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        self.inner.simulated_io()
    }
}

impl Hub {
    /// The answers kept so far, also after a viewer that panicked: nothing is half written.
    fn received(&self) -> MutexGuard<'_, Received> {
        self.received.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn errands(&self) -> MutexGuard<'_, Vec<Errand>> {
        self.errands.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take_errands(&self) -> Vec<Errand> {
        std::mem::take(&mut self.errands())
    }

    fn keep(&self, reply: Reply) {
        let mut received = self.received();
        match reply {
            Reply::Identity(identity) => received.identity = Some(identity),
            Reply::Status(status) => received.status.set(status),
            Reply::Inputs(inputs) => received.inputs.set(inputs),
            Reply::Learning(learning) => received.learning.set(learning),
            Reply::Fault(fault) => received.fault.set(fault),
            _ => {}
        }
    }

    fn broadcast(&self, notice: &Notice) {
        for viewer in self.received().viewers.values() {
            // One that is slow misses it.
            let _ = viewer.try_send(notice.clone());
        }
    }

    /// The answer to a viewer.
    fn answer(&self, viewer: u64, body: Body) -> Answer {
        if matches!(body, Body::Stop | Body::Disable) {
            return self.pass_on(viewer, body);
        }
        let received = self.received();
        let known = match body {
            Body::Hello => match received.identity.clone() {
                Some(identity) => Ok(Reply::Identity(identity)),
                None => Err(None),
            },
            Body::Status => received.status.fresh().map(Reply::Status),
            Body::Inputs => received.inputs.fresh().map(Reply::Inputs),
            Body::Learning => received.learning.fresh().map(Reply::Learning),
            Body::Fault => received.fault.fresh().map(Reply::Fault),
            _ => {
                return Err(LinkError::Refused(text(format_args!(
                    "another program holds the machine: this one may look, stop and disable"
                ))));
            }
        };
        known.map_err(|age| match age {
            Some(age) => LinkError::Busy(text(format_args!(
                "the program that holds the machine received this {:.1} s ago, and nothing since{}",
                age.as_secs_f64(),
                received.last()
            ))),
            None => LinkError::Busy(text(format_args!(
                "the machine has not reported to its holder yet; ask again"
            ))),
        })
    }

    /// Has the holder ask the machine, and waits for the machine's answer.
    fn pass_on(&self, viewer: u64, body: Body) -> Answer {
        let (answer, answered) = mpsc::sync_channel(1);
        self.errands().push(Errand {
            viewer,
            body,
            answer,
        });
        answered.recv_timeout(PASSED_ON).unwrap_or_else(|_| {
            // What the holder has not taken is not done later, unasked.
            let mut errands = self.errands();
            let waiting = errands.len();
            errands.retain(|errand| errand.viewer != viewer);
            let done = match errands.len() < waiting {
                true => "not done: the program that holds the machine does not pass it on",
                false => "perhaps not done: the machine gave its holder no answer",
            };
            Err(LinkError::Refused(text(format_args!(
                "{done} within {} ms; use the machine's own stop",
                PASSED_ON.as_millis()
            ))))
        })
    }
}

impl Received {
    /// The last state, in words.
    fn last(&self) -> String {
        let Some((status, _)) = &self.status.0 else {
            return String::new();
        };
        let motion = if status.running { "moving" } else { "at rest" };
        let mut words = format!("; it was {}, {motion}", status.state.as_str());
        for (axis, seen) in AxisName::ALL.into_iter().zip(&status.axes) {
            let _ = write!(words, ", {axis} {:.3} mm", seen.position_mm);
        }
        words
    }
}

/// The addresses that a `host:port` names; a port alone is one of this computer.
fn addresses(address: &str) -> io::Result<Vec<SocketAddr>> {
    match address.parse() {
        Ok(port) => Ok(vec![SocketAddr::new(IpAddr::from([127, 0, 0, 1]), port)]),
        Err(_) => Ok(address.to_socket_addrs()?.collect()),
    }
}

/// A token that nobody guesses.
fn new_token() -> io::Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Ok(bytes.iter().fold(String::new(), |mut token, byte| {
        let _ = write!(token, "{byte:02x}");
        token
    }))
}

/// Takes viewers, as many as there may be.
fn accept(listener: &TcpListener, hub: &Arc<Hub>, token: Option<&str>) {
    for (stream, number) in listener.incoming().zip(0..) {
        let Ok(stream) = stream else {
            thread::sleep(REFUSED_PAUSE);
            continue;
        };
        if hub.viewers.load(Ordering::Relaxed) >= MOST_VIEWERS {
            continue;
        }
        hub.viewers.fetch_add(1, Ordering::Relaxed);
        let (hub, token) = (Arc::clone(hub), token.map(str::to_owned));
        let viewer = Viewer { hub, number };
        // A viewer whose connection fails, or that finds no thread, is gone, and nothing else.
        let _ = thread::Builder::new()
            .stack_size(VIEWER_STACK)
            .spawn(move || drop(viewer.serve(stream, token.as_deref())));
    }
}

/// Stack of a viewer's thread, bytes.
const VIEWER_STACK: usize = 256 << 10;

/// One of the viewers that there may be, until it is dropped.
struct Viewer {
    hub: Arc<Hub>,
    number: u64,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.hub.received().viewers.remove(&self.number);
        self.hub.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Viewer {
    /// Answers a viewer until it is gone, or silent for too long.
    fn serve(&self, mut stream: TcpStream, token: Option<&str>) -> io::Result<()> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(TAKING))?;
        let began = Instant::now();
        let admitted = match token {
            Some(token) => is_same(&given(&mut stream, began)?, token.as_bytes()),
            None => true,
        };
        let mut notices = None;
        let mut server = LinkServer::new();
        let mut last = began;
        let mut buffer = [0; FRAME_BYTES];
        loop {
            if let Some(notices) = &notices {
                send(notices, &mut stream)?;
            }
            let most = if server.is_greeted() {
                SILENCE
            } else {
                GREETING
            };
            if last.elapsed() > most {
                return Ok(());
            }
            let read = stream.read(&mut buffer);
            if matches!(read, Ok(0)) {
                return Ok(());
            }
            for &byte in &buffer[..or_none(read)?] {
                let answer = |body| match admitted {
                    true => self.hub.answer(self.number, body),
                    false => Err(refused_token()),
                };
                if let Some(response) = server.push(byte, answer) {
                    stream.write_all(&encoded(&Message::Response(response)))?;
                    if !admitted {
                        return Ok(());
                    }
                    // Whole requests alone count: a stream of anything else is silence.
                    last = Instant::now();
                }
            }
            if notices.is_none() && server.is_greeted() {
                notices = Some(self.subscribe());
            }
        }
    }

    fn subscribe(&self) -> Receiver<Notice> {
        let (sender, notices) = mpsc::sync_channel(WAITING);
        self.hub.received().viewers.insert(self.number, sender);
        notices
    }
}

fn refused_token() -> LinkError {
    LinkError::Refused(text(format_args!(
        "the token is missing or another one: give `--token`, as the program shows that holds the machine"
    )))
}

/// The token with which a viewer begins, up to the delimiter behind it.
fn given(stream: &mut TcpStream, began: Instant) -> io::Result<Vec<u8>> {
    let mut token = Vec::new();
    while began.elapsed() <= GREETING && token.len() <= TOKEN_CHARS {
        let mut byte = [0];
        let read = stream.read(&mut byte);
        if matches!(read, Ok(0)) {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        match or_none(read)? {
            0 => {}
            _ if byte[0] == DELIMITER => return Ok(token),
            _ => token.push(byte[0]),
        }
    }
    Ok(token)
}

/// Compares in a time that does not depend on where they differ.
fn is_same(given: &[u8], token: &[u8]) -> bool {
    let differences = given.iter().zip(token).map(|(a, b)| a ^ b);
    given.len() == token.len() && differences.fold(0, |all, bits| all | bits) == 0
}

/// Sends the notices that have come.
fn send(notices: &Receiver<Notice>, stream: &mut TcpStream) -> io::Result<()> {
    for notice in notices.try_iter() {
        stream.write_all(&encoded(&Message::Notice(notice)))?;
    }
    Ok(())
}
