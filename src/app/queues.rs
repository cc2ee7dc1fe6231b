//! The queues between the control interrupt, the supervising task and the server.

use core::sync::atomic::{AtomicU32, Ordering};

use heapless_queues::spsc::{Consumer, Producer, Queue};

use super::Axis;
use crate::app::capture::Capture;
use crate::app::telemetry::{Sample, Sampler};
use quadrant_law::axes::AxisName;
use quadrant_law::cancelling::SpindleSpeed;
use quadrant_law::command::Command;
use quadrant_law::injection::{Injection, VoltageBlock};
use quadrant_law::reference::Segment;
use quadrant_law::safety::Operation;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::Plan;

/// An order of the server to the control law, which takes one a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Act on a command.
    Command(Command),
    /// Take the plan that waits, as a whole.
    Plan,
    /// Take one axis' motion of the plan that waits, and start it.
    Move(AxisName),
    /// Take the speed of the spindle over.
    Spindle(SpindleSpeed),
    /// Keep the outputs off.
    Lock,
    /// No longer keep the outputs off.
    Unlock {
        /// Valid settings were stored meanwhile.
        stored: bool,
    },
}

/// An axis with new settings on its way into the control law, with the stage's settings beside it.
#[derive(Debug)]
pub(super) struct AxisSwap<'a, S: Scalar> {
    pub(super) name: AxisName,
    pub(super) axis: &'a mut Axis<S>,
    pub(super) operation: Operation,
    /// It waits until the outputs are off.
    pub(super) needs_disabled: bool,
    /// Another axis of the same settings follows: the outputs stay off until then.
    pub(super) more: bool,
    /// The axis is homed in another way than before: its position is not that of the machine until it is homed again.
    pub(super) new_origin: bool,
}

/// An item that waits for the control law: of a stream or of an injection, never of both.
#[derive(Clone, Debug)]
// They share the room of one queue.
#[allow(clippy::large_enum_variant)]
pub(super) enum StreamItem<S: Scalar> {
    /// The next segments of a stream.
    Segments([Segment; 3]),
    /// Another injection.
    Injection(Injection<S>),
    /// Its next values.
    Voltages(VoltageBlock),
}

/// A command of the server about the capture.
#[derive(Debug)]
pub(super) enum CaptureCommand<'a> {
    /// Records until frozen, then gives the capture back.
    Record(Capture<'a>),
    /// Gives the capture back now.
    GiveBack,
}

// Sizes of the queues: powers of two, so that their indices are cut by a mask; each has room for one less.
const ONE: usize = 2;
const ORDERS: usize = 8;
/// Bytes of the link that wait for the server: two of the longest frames, as in the reference board's own ring.
const BYTES: usize = 1024;
/// Size of the queue of a stream's items.
const STREAM_ITEMS: usize = 16;
/// Samples of each tick of 3 ms at 10 kHz; of 100 ms, where the server's thread waits for an operating system.
const SAMPLES: usize = if cfg!(target_os = "none") { 32 } else { 1024 };

/// Segments of a stream, or blocks of an injection, that may wait for the control law.
pub(super) const STREAM_ITEM_ROOM: usize = STREAM_ITEMS - 1;

/// The queues, each with room for one less than its size.
pub struct Queues<'a, S: Scalar> {
    orders: Queue<Order, ORDERS>,
    swaps: Queue<AxisSwap<'a, S>, ONE>,
    back_buffers: Queue<&'a mut Axis<S>, ONE>,
    plans: Queue<Plan<S>, ONE>,
    stream_items: Queue<StreamItem<S>, STREAM_ITEMS>,
    samplers: Queue<Sampler, ONE>,
    samples: Queue<Sample, SAMPLES>,
    capture_commands: Queue<CaptureCommand<'a>, ONE>,
    captures: Queue<Capture<'a>, ONE>,
    bytes: Queue<u8, BYTES>,
    urgent: AtomicU32,
}

impl<S: Scalar> Default for Queues<'_, S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, S: Scalar> Queues<'a, S> {
    /// Returns empty queues.
    pub const fn new() -> Self {
        Self {
            orders: Queue::new(),
            swaps: Queue::new(),
            back_buffers: Queue::new(),
            plans: Queue::new(),
            stream_items: Queue::new(),
            samplers: Queue::new(),
            samples: Queue::new(),
            capture_commands: Queue::new(),
            captures: Queue::new(),
            bytes: Queue::new(),
            urgent: AtomicU32::new(0),
        }
    }

    /// Splits the queues into their three sides.
    pub fn split<'q>(
        &'q mut self,
    ) -> (
        ControlEnds<'q, 'a, S>,
        IntakeEnds<'q>,
        ServerEnds<'q, 'a, S>,
    ) {
        let (orders_in, orders) = self.orders.split();
        let (swaps_in, swaps) = self.swaps.split();
        let (back_buffers_in, back_buffers) = self.back_buffers.split();
        let (plans_in, plans) = self.plans.split();
        let (stream_items_in, stream_items) = self.stream_items.split();
        let (samplers_in, samplers) = self.samplers.split();
        let (samples_in, samples) = self.samples.split();
        let (capture_commands_in, capture_commands) = self.capture_commands.split();
        let (captures_in, captures) = self.captures.split();
        let (bytes_in, bytes) = self.bytes.split();
        let urgent = &self.urgent;
        let control = ControlEnds {
            orders,
            swaps,
            back_buffers: back_buffers_in,
            plans,
            stream_items,
            samplers,
            samples: samples_in,
            capture_commands,
            captures: captures_in,
        };
        let server = ServerEnds {
            orders: orders_in,
            swaps: swaps_in,
            back_buffers,
            plans: plans_in,
            stream_items: stream_items_in,
            samplers: samplers_in,
            samples,
            capture_commands: capture_commands_in,
            captures,
            bytes,
            urgent,
        };
        let intake = IntakeEnds {
            bytes: bytes_in,
            urgent,
        };
        (control, intake, server)
    }
}

/// The control interrupt's side.
pub struct ControlEnds<'q, 'a, S: Scalar> {
    pub(super) orders: Consumer<'q, Order, ORDERS>,
    pub(super) swaps: Consumer<'q, AxisSwap<'a, S>, ONE>,
    pub(super) back_buffers: Producer<'q, &'a mut Axis<S>, ONE>,
    pub(super) plans: Consumer<'q, Plan<S>, ONE>,
    pub(super) stream_items: Consumer<'q, StreamItem<S>, STREAM_ITEMS>,
    pub(super) samplers: Consumer<'q, Sampler, ONE>,
    pub(super) samples: Producer<'q, Sample, SAMPLES>,
    pub(super) capture_commands: Consumer<'q, CaptureCommand<'a>, ONE>,
    pub(super) captures: Producer<'q, Capture<'a>, ONE>,
}

/// The server's side.
pub struct ServerEnds<'q, 'a, S: Scalar> {
    pub(super) orders: Producer<'q, Order, ORDERS>,
    pub(super) swaps: Producer<'q, AxisSwap<'a, S>, ONE>,
    pub(super) back_buffers: Consumer<'q, &'a mut Axis<S>, ONE>,
    pub(super) plans: Producer<'q, Plan<S>, ONE>,
    pub(super) stream_items: Producer<'q, StreamItem<S>, STREAM_ITEMS>,
    pub(super) samplers: Producer<'q, Sampler, ONE>,
    pub(super) samples: Consumer<'q, Sample, SAMPLES>,
    pub(super) capture_commands: Producer<'q, CaptureCommand<'a>, ONE>,
    pub(super) captures: Consumer<'q, Capture<'a>, ONE>,
    pub(super) bytes: Consumer<'q, u8, BYTES>,
    urgent: &'q AtomicU32,
}

impl<S: Scalar> ServerEnds<'_, '_, S> {
    /// Number of urgent requests that have been received so far.
    pub(super) fn urgent(&self) -> u32 {
        self.urgent.load(Ordering::Acquire)
    }
}

/// The side of the supervising task, which receives the link's bytes.
pub struct IntakeEnds<'q> {
    pub(super) bytes: Producer<'q, u8, BYTES>,
    urgent: &'q AtomicU32,
}

impl IntakeEnds<'_> {
    /// Counts an urgent request, after its last byte was passed on. Only this side writes.
    pub(super) fn count_urgent(&mut self) {
        let count = self.urgent.load(Ordering::Relaxed).wrapping_add(1);
        self.urgent.store(count, Ordering::Release);
    }
}
