//! What passes between the control interrupt and the server.

use heapless_queues::spsc::{Consumer, Producer, Queue};

use super::Axis;
use crate::law::axes::AxisName;
use crate::law::capture::Capture;
use crate::law::command::Command;
use crate::law::injection::{Injection, VoltageBlock};
use crate::law::reference::{Motion, Segment};
use crate::law::safety::StreamLoss;
use crate::law::scalar::Scalar;
use crate::law::telemetry::{Sample, Sampler};

/// An axis on its way into the control law, and what belongs to the stage beside it.
#[derive(Debug)]
pub(super) struct Exchange<'a, S: Scalar> {
    pub(super) name: AxisName,
    pub(super) axis: &'a mut Axis<S>,
    pub(super) streaming: StreamLoss,
}

/// What waits for the control law, tick for tick: of a stream or of an injection, never of both.
#[derive(Clone, Debug)]
// They share the room of one queue.
#[allow(clippy::large_enum_variant)]
pub(super) enum Feed<S: Scalar> {
    /// The next segments of a stream.
    Segments([Segment; 3]),
    /// Another injection.
    Injection(Injection<S>),
    /// Its next values.
    Voltages(VoltageBlock),
}

/// What the server asks of the capture.
#[derive(Debug)]
pub(super) enum CaptureOrder<'a> {
    /// Record until frozen, then give it back.
    Record(Capture<'a>),
    /// Give it back now.
    GiveBack,
}

// Sizes of the queues: powers of two, so that their indices are cut by a mask; each has room for one less.
const ONE: usize = 2;
const COMMANDS: usize = 8;
const MOTIONS: usize = 4;
const FEEDS: usize = 16;
/// Samples of each tick of 3 ms at 10 kHz.
const SAMPLES: usize = 32;

/// Segments of a stream, or blocks of an injection, that may wait for the control law.
pub(super) const FEED_ROOM: usize = FEEDS - 1;

/// The queues, each with room for one less than its size.
pub struct Queues<'a, S: Scalar> {
    commands: Queue<Command, COMMANDS>,
    exchanges: Queue<Exchange<'a, S>, ONE>,
    spares: Queue<&'a mut Axis<S>, ONE>,
    motions: Queue<(AxisName, Motion<S>), MOTIONS>,
    feeds: Queue<Feed<S>, FEEDS>,
    samplers: Queue<Sampler, ONE>,
    samples: Queue<Sample, SAMPLES>,
    orders: Queue<CaptureOrder<'a>, ONE>,
    captures: Queue<Capture<'a>, ONE>,
}

impl<S: Scalar> Default for Queues<'_, S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, S: Scalar> Queues<'a, S> {
    /// Empty queues.
    pub const fn new() -> Self {
        Self {
            commands: Queue::new(),
            exchanges: Queue::new(),
            spares: Queue::new(),
            motions: Queue::new(),
            feeds: Queue::new(),
            samplers: Queue::new(),
            samples: Queue::new(),
            orders: Queue::new(),
            captures: Queue::new(),
        }
    }

    /// The two sides.
    pub fn split<'q>(&'q mut self) -> (ControlEnds<'q, 'a, S>, ServerEnds<'q, 'a, S>) {
        let (commands_in, commands) = self.commands.split();
        let (exchanges_in, exchanges) = self.exchanges.split();
        let (spares_in, spares) = self.spares.split();
        let (motions_in, motions) = self.motions.split();
        let (feeds_in, feeds) = self.feeds.split();
        let (samplers_in, samplers) = self.samplers.split();
        let (samples_in, samples) = self.samples.split();
        let (orders_in, orders) = self.orders.split();
        let (captures_in, captures) = self.captures.split();
        let control = ControlEnds {
            commands,
            exchanges,
            spares: spares_in,
            motions,
            feeds,
            samplers,
            samples: samples_in,
            orders,
            captures: captures_in,
        };
        let server = ServerEnds {
            commands: commands_in,
            exchanges: exchanges_in,
            spares,
            motions: motions_in,
            feeds: feeds_in,
            samplers: samplers_in,
            samples,
            orders: orders_in,
            captures,
        };
        (control, server)
    }
}

/// The control interrupt's side.
pub struct ControlEnds<'q, 'a, S: Scalar> {
    pub(super) commands: Consumer<'q, Command, COMMANDS>,
    pub(super) exchanges: Consumer<'q, Exchange<'a, S>, ONE>,
    pub(super) spares: Producer<'q, &'a mut Axis<S>, ONE>,
    pub(super) motions: Consumer<'q, (AxisName, Motion<S>), MOTIONS>,
    pub(super) feeds: Consumer<'q, Feed<S>, FEEDS>,
    pub(super) samplers: Consumer<'q, Sampler, ONE>,
    pub(super) samples: Producer<'q, Sample, SAMPLES>,
    pub(super) orders: Consumer<'q, CaptureOrder<'a>, ONE>,
    pub(super) captures: Producer<'q, Capture<'a>, ONE>,
}

/// The server's side.
pub struct ServerEnds<'q, 'a, S: Scalar> {
    pub(super) commands: Producer<'q, Command, COMMANDS>,
    pub(super) exchanges: Producer<'q, Exchange<'a, S>, ONE>,
    pub(super) spares: Consumer<'q, &'a mut Axis<S>, ONE>,
    pub(super) motions: Producer<'q, (AxisName, Motion<S>), MOTIONS>,
    pub(super) feeds: Producer<'q, Feed<S>, FEEDS>,
    pub(super) samplers: Producer<'q, Sampler, ONE>,
    pub(super) samples: Consumer<'q, Sample, SAMPLES>,
    pub(super) orders: Producer<'q, CaptureOrder<'a>, ONE>,
    pub(super) captures: Consumer<'q, Capture<'a>, ONE>,
}
