//! The queues between the control interrupt and the server.

use heapless_queues::spsc::{Consumer, Producer, Queue};

use super::Axis;
use crate::app::capture::Capture;
use crate::app::telemetry::{Sample, Sampler};
use crate::law::axes::AxisName;
use crate::law::command::Command;
use crate::law::injection::{Injection, VoltageBlock};
use crate::law::reference::{Motion, Segment};
use crate::law::safety::StreamLoss;
use crate::law::scalar::Scalar;

/// An axis with new settings on its way into the control law, with the stage's settings beside it.
#[derive(Debug)]
pub(super) struct AxisSwap<'a, S: Scalar> {
    pub(super) name: AxisName,
    pub(super) axis: &'a mut Axis<S>,
    pub(super) streaming: StreamLoss,
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
const COMMANDS: usize = 8;
const MOTIONS: usize = 4;
const STREAM_ITEMS: usize = 16;
/// Samples of each tick of 3 ms at 10 kHz.
const SAMPLES: usize = 32;

/// Segments of a stream, or blocks of an injection, that may wait for the control law.
pub(super) const STREAM_ITEM_ROOM: usize = STREAM_ITEMS - 1;

/// The queues, each with room for one less than its size.
pub struct Queues<'a, S: Scalar> {
    commands: Queue<Command, COMMANDS>,
    swaps: Queue<AxisSwap<'a, S>, ONE>,
    back_buffers: Queue<&'a mut Axis<S>, ONE>,
    motions: Queue<(AxisName, Motion<S>), MOTIONS>,
    stream_items: Queue<StreamItem<S>, STREAM_ITEMS>,
    samplers: Queue<Sampler, ONE>,
    samples: Queue<Sample, SAMPLES>,
    capture_commands: Queue<CaptureCommand<'a>, ONE>,
    captures: Queue<Capture<'a>, ONE>,
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
            commands: Queue::new(),
            swaps: Queue::new(),
            back_buffers: Queue::new(),
            motions: Queue::new(),
            stream_items: Queue::new(),
            samplers: Queue::new(),
            samples: Queue::new(),
            capture_commands: Queue::new(),
            captures: Queue::new(),
        }
    }

    /// Splits the queues into their two sides.
    pub fn split<'q>(&'q mut self) -> (ControlEnds<'q, 'a, S>, ServerEnds<'q, 'a, S>) {
        let (commands_in, commands) = self.commands.split();
        let (swaps_in, swaps) = self.swaps.split();
        let (back_buffers_in, back_buffers) = self.back_buffers.split();
        let (motions_in, motions) = self.motions.split();
        let (stream_items_in, stream_items) = self.stream_items.split();
        let (samplers_in, samplers) = self.samplers.split();
        let (samples_in, samples) = self.samples.split();
        let (capture_commands_in, capture_commands) = self.capture_commands.split();
        let (captures_in, captures) = self.captures.split();
        let control = ControlEnds {
            commands,
            swaps,
            back_buffers: back_buffers_in,
            motions,
            stream_items,
            samplers,
            samples: samples_in,
            capture_commands,
            captures: captures_in,
        };
        let server = ServerEnds {
            commands: commands_in,
            swaps: swaps_in,
            back_buffers,
            motions: motions_in,
            stream_items: stream_items_in,
            samplers: samplers_in,
            samples,
            capture_commands: capture_commands_in,
            captures,
        };
        (control, server)
    }
}

/// The control interrupt's side.
pub struct ControlEnds<'q, 'a, S: Scalar> {
    pub(super) commands: Consumer<'q, Command, COMMANDS>,
    pub(super) swaps: Consumer<'q, AxisSwap<'a, S>, ONE>,
    pub(super) back_buffers: Producer<'q, &'a mut Axis<S>, ONE>,
    pub(super) motions: Consumer<'q, (AxisName, Motion<S>), MOTIONS>,
    pub(super) stream_items: Consumer<'q, StreamItem<S>, STREAM_ITEMS>,
    pub(super) samplers: Consumer<'q, Sampler, ONE>,
    pub(super) samples: Producer<'q, Sample, SAMPLES>,
    pub(super) capture_commands: Consumer<'q, CaptureCommand<'a>, ONE>,
    pub(super) captures: Producer<'q, Capture<'a>, ONE>,
}

/// The server's side.
pub struct ServerEnds<'q, 'a, S: Scalar> {
    pub(super) commands: Producer<'q, Command, COMMANDS>,
    pub(super) swaps: Producer<'q, AxisSwap<'a, S>, ONE>,
    pub(super) back_buffers: Consumer<'q, &'a mut Axis<S>, ONE>,
    pub(super) motions: Producer<'q, (AxisName, Motion<S>), MOTIONS>,
    pub(super) stream_items: Producer<'q, StreamItem<S>, STREAM_ITEMS>,
    pub(super) samplers: Producer<'q, Sampler, ONE>,
    pub(super) samples: Consumer<'q, Sample, SAMPLES>,
    pub(super) capture_commands: Producer<'q, CaptureCommand<'a>, ONE>,
    pub(super) captures: Consumer<'q, Capture<'a>, ONE>,
}
