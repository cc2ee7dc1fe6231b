//! A machine that this program holds and lets others look at: they see what it hears, and may stop the axes.
//!
//! Viewers speak the link's protocol over a socket, so the same client serves. They are answered from what the machine has
//! told its holder last; of theirs nothing but `Stop` and `Disable` reaches it, so that a viewer is no host to a motion that
//! needs one.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use quadrant::link::frame::{self, FRAME_BYTES};
use quadrant::link::message::{
    Body, FaultReport, Identity, Inputs, Learning, LinkError, Message, Notice, Reply, Request,
    Status, text,
};
use quadrant::link::server::LinkServer;

use super::simulated_io::SimulatedIo;
use super::stream::or_none;
use super::transport::{Transport, encoded};

/// Number of a viewer's requests on their way to the machine; the client never gives it.
pub const VIEWER_ID: u16 = u16::MAX;
/// Notices that wait for a viewer; one that is slower misses the newest.
const WAITING: usize = 1000;
/// Time between two looks at what a viewer is to be told.
const LOOK: Duration = Duration::from_millis(20);
/// Time in which a viewer takes what it is sent; after that it is gone.
const TAKING: Duration = Duration::from_secs(2);

/// A viewer's wish of the machine: none, to stop, or to disable, the stronger of them.
const NOTHING: u8 = 0;
const STOP: u8 = 1;
const DISABLE: u8 = 2;

/// A transport whose other end others may look at.
pub struct Shared<T> {
    inner: T,
    receiver: frame::Receiver,
    hub: Arc<Hub>,
    address: SocketAddr,
}

/// The common ground of holder and viewers.
#[derive(Default)]
struct Hub {
    heard: Mutex<Heard>,
    asked: AtomicU8,
}

/// The machine's last answers, and who is told its notices.
#[derive(Default)]
struct Heard {
    identity: Option<Identity>,
    status: Option<Status>,
    inputs: Option<Inputs>,
    learning: Option<Learning>,
    fault: Option<Option<FaultReport>>,
    viewers: Vec<SyncSender<Notice>>,
}

impl<T: Transport> Shared<T> {
    /// Lets others look at `address`, as `host:port`, from now on.
    ///
    /// # Errors
    /// An address that is none, or that is taken.
    pub fn listen(inner: T, address: &str) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let hub = Arc::new(Hub::default());
        let of_viewers = Arc::clone(&hub);
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let hub = Arc::clone(&of_viewers);
                // A viewer whose connection fails is gone, and nothing else.
                thread::spawn(move || drop(serve(&hub, stream)));
            }
        });
        Ok(Self {
            inner,
            receiver: frame::Receiver::new(),
            hub,
            address,
        })
    }

    /// The address at which others look.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Passes on what a viewer asked for.
    fn pass_on(&mut self) -> io::Result<()> {
        let body = match self.hub.asked.swap(NOTHING, Ordering::Relaxed) {
            NOTHING => return Ok(()),
            STOP => Body::Stop,
            _ => Body::Disable,
        };
        let request = Request {
            id: VIEWER_ID,
            body,
        };
        self.inner.send(&encoded(&request))
    }
}

impl<T: Transport> Transport for Shared<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.pass_on()?;
        self.inner.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.pass_on()?;
        let count = self.inner.receive(buffer, timeout)?;
        for &byte in &buffer[..count] {
            if let Some(payload) = self.receiver.push(byte)
                && let Ok(message) = frame::decode::<Message>(payload)
            {
                self.hub.hear(message);
            }
        }
        Ok(count)
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
    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn hear(&self, message: Message) {
        let mut heard = self.heard();
        match message {
            Message::Response(response) => match response.result {
                Ok(Reply::Identity(identity)) => heard.identity = Some(identity),
                Ok(Reply::Status(status)) => heard.status = Some(status),
                Ok(Reply::Inputs(inputs)) => heard.inputs = Some(inputs),
                Ok(Reply::Learning(learning)) => heard.learning = Some(learning),
                Ok(Reply::Fault(fault)) => heard.fault = Some(fault),
                _ => {}
            },
            Message::Notice(notice) => heard.viewers.retain(|viewer| {
                !matches!(
                    viewer.try_send(notice.clone()),
                    Err(TrySendError::Disconnected(_))
                )
            }),
        }
    }

    /// The answer to a viewer.
    fn answer(&self, body: &Body) -> Result<Reply, LinkError> {
        let asked = match body {
            Body::Stop => STOP,
            Body::Disable => DISABLE,
            _ => NOTHING,
        };
        if asked != NOTHING {
            self.asked.fetch_max(asked, Ordering::Relaxed);
            return Ok(Reply::Done);
        }
        let heard = self.heard();
        let known = match body {
            Body::Hello => heard.identity.clone().map(Reply::Identity),
            Body::Status => heard.status.clone().map(Reply::Status),
            Body::Inputs => heard.inputs.clone().map(Reply::Inputs),
            Body::Learning => heard.learning.clone().map(Reply::Learning),
            Body::Fault => heard.fault.clone().map(Reply::Fault),
            _ => {
                return Err(LinkError::Refused(text(format_args!(
                    "another program holds the machine: this one may look, stop and disable"
                ))));
            }
        };
        known.ok_or_else(|| {
            LinkError::Busy(text(format_args!(
                "the machine has not told its holder yet; ask again"
            )))
        })
    }
}

/// Answers a viewer until it is gone.
fn serve(hub: &Hub, mut stream: TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(TAKING))?;
    let (sender, notices) = mpsc::sync_channel(WAITING);
    hub.heard().viewers.push(sender);
    let mut server = LinkServer::new();
    let mut buffer = [0; FRAME_BYTES];
    loop {
        tell(&notices, &mut stream)?;
        let read = stream.read(&mut buffer);
        if matches!(read, Ok(0)) {
            return Ok(());
        }
        for &byte in &buffer[..or_none(read)?] {
            if let Some(response) = server.push(byte, |body| hub.answer(&body)) {
                stream.write_all(&encoded(&Message::Response(response)))?;
            }
        }
    }
}

/// Sends the notices that have come.
fn tell(notices: &Receiver<Notice>, stream: &mut TcpStream) -> io::Result<()> {
    for notice in notices.try_iter() {
        stream.write_all(&encoded(&Message::Notice(notice)))?;
    }
    Ok(())
}
