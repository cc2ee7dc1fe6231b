//! The fast half: the state and the work of the control interrupt.

use super::glitch_monitor::GlitchReadings;
use super::queues::{AxisSwap, CaptureCommand, ControlEnds, StreamItem};
use super::{Axis, Snapshot};
use crate::app::capture::Capture;
use crate::app::supervisor::PERIOD_TICKS;
use crate::app::telemetry::{Observation, Sampler, SamplerState};
use crate::law::axes::{AxisName, PerAxis};
use crate::law::friction::gms::FIRMWARE_ELEMENTS;
use crate::law::reference::Motion;
use crate::law::safety::{FaultCode, StreamLoss};
use crate::law::scalar::Scalar;
use crate::law::stage::{Inputs, Outputs, Plan, StageRef, StageState};

/// Everything that the control interrupt owns.
pub struct Control<'q, 'a, S: Scalar> {
    axes: PerAxis<&'a mut Axis<S>>,
    streaming: StreamLoss,
    plan: Plan<S>,
    state: StageState<S, FIRMWARE_ELEMENTS>,
    sampler: Sampler,
    sampling: SamplerState,
    capture: Option<Capture<'a>>,
    glitches: GlitchReadings,
    commanded: bool,
    /// Values of the first waiting block that were taken.
    place: usize,
    ends: ControlEnds<'q, 'a, S>,
}

impl<'q, 'a, S: Scalar> Control<'q, 'a, S> {
    /// Returns the fast half before the first tick.
    // Not inlined: its frame is gone when the start goes on.
    #[inline(never)]
    pub fn new(
        axes: PerAxis<&'a mut Axis<S>>,
        streaming: StreamLoss,
        plan: Plan<S>,
        ends: ControlEnds<'q, 'a, S>,
    ) -> Self {
        Self {
            axes,
            streaming,
            plan,
            state: StageState::default(),
            sampler: Sampler::default(),
            sampling: SamplerState::default(),
            capture: None,
            glitches: GlitchReadings::default(),
            commanded: false,
            place: 0,
            ends,
        }
    }

    /// Starts with a fault latched, before the first tick: what the last run or the stored settings left.
    pub fn start_faulted(&mut self, code: FaultCode) {
        self.state.start_faulted(code);
    }

    /// Sets the glitch monitor's results, which telemetry channels show.
    pub const fn show_glitches(&mut self, readings: GlitchReadings) {
        self.glitches = readings;
    }

    /// The state of the control law.
    pub fn state(&self) -> &StageState<S, FIRMWARE_ELEMENTS> {
        &self.state
    }

    /// One control period: takes what the server has sent, and computes the outputs. The settings' changes are its own to
    /// tell, and a command of the server's acts when the inputs have none.
    #[inline(always)]
    pub fn tick(&mut self, inputs: &Inputs) -> Outputs {
        let settings_changed = match self.ends.swaps.dequeue() {
            Some(swap) => self.swap(swap),
            None => PerAxis::splat(false),
        };
        if let Some((name, motion)) = self.ends.motions.dequeue() {
            self.take_motion(name, motion);
        }
        match self.ends.stream_items.peek() {
            None => {}
            Some(StreamItem::Segments(_)) => self.take_segments(),
            Some(StreamItem::Injection(_) | StreamItem::Voltages(_)) => self.take_voltage(),
        }
        let command = inputs.command.or_else(|| self.ends.commands.dequeue());
        self.commanded = command.is_some();
        let axes = self.axes.each_ref().map(|axis| &**axis);
        StageRef {
            axes: axes.into(),
            streaming: self.streaming,
        }
        .tick(
            &self.plan,
            &mut self.state,
            &Inputs {
                command,
                settings_changed,
                ..*inputs
            },
        )
    }

    /// Samples telemetry and capture after the outputs are written. Returns true if the supervising task's [`snapshot`] is
    /// due.
    ///
    /// [`snapshot`]: Self::snapshot
    #[inline(always)]
    pub fn observe(&mut self, elapsed_cycles: u32) -> bool {
        if let Some(sampler) = self.ends.samplers.dequeue() {
            self.sampler = sampler;
        }
        if let Some(command) = self.ends.capture_commands.dequeue() {
            self.take_capture_command(command);
        }
        let seen = Observation {
            stage: &self.state,
            glitches: &self.glitches,
            elapsed_cycles,
            commanded: self.commanded,
        };
        if let Some(sample) = self.sampler.step(&mut self.sampling, &seen) {
            // A full queue drops the newest; its number is missing, so that the server can tell.
            let _ = self.ends.samples.enqueue(sample);
        }
        let full = self
            .capture
            .as_mut()
            .is_some_and(|capture| capture.step(&seen));
        if full {
            self.give_capture_back();
        }
        self.state.tick().is_multiple_of(PERIOD_TICKS)
    }

    /// The supervising task's view of the last tick. By itself, as an `Option` of it would be copied once more.
    #[inline(always)]
    pub fn snapshot(&self) -> Snapshot<S> {
        Snapshot::of(&self.state)
    }

    /// Replaces an axis; the old one goes back to the server as its back buffer.
    #[cold]
    #[inline(never)]
    fn swap(&mut self, swap: AxisSwap<'a, S>) -> PerAxis<bool> {
        let AxisSwap {
            name,
            axis,
            streaming,
        } = swap;
        // There is one back buffer, so the queue has room for it.
        let replaced = core::mem::replace(&mut self.axes[name], axis);
        let _ = self.ends.back_buffers.enqueue(replaced);
        self.streaming = streaming;
        PerAxis::from_fn(|axis| axis == name)
    }

    /// Takes the motion that an axis will start next. One that comes while the axis follows the old one is dropped: the
    /// server sends none then.
    #[cold]
    #[inline(never)]
    fn take_motion(&mut self, name: AxisName, motion: Motion<S>) {
        if !self.state.axes()[name].is_running() {
            self.plan[name] = motion;
        }
    }

    /// Passes the axes the next segments of a stream, if they have room.
    #[inline(always)]
    fn take_segments(&mut self) {
        if self.state.axes().iter().all(|axis| axis.wants_segment())
            && let Some(StreamItem::Segments(segments)) = self.ends.stream_items.dequeue()
        {
            for (name, segment) in AxisName::ALL.into_iter().zip(segments) {
                self.state.offer_segment(name, segment);
            }
        }
    }

    /// Passes the next value of an injection on, if there is room. What is left of one that was broken off is dropped.
    #[cold]
    #[inline(never)]
    fn take_voltage(&mut self) {
        let used = match self.ends.stream_items.peek() {
            Some(StreamItem::Injection(injection)) => {
                self.state.prepare_injection(injection.clone());
                true
            }
            Some(StreamItem::Voltages(_)) if !self.state.has_injection() => true,
            Some(StreamItem::Voltages(block)) => {
                if self.state.wants_voltage()
                    && let Some(value) = block.value(self.place)
                {
                    self.state.offer_value(value);
                    self.place += 1;
                }
                self.place >= block.len()
            }
            Some(StreamItem::Segments(_)) | None => false,
        };
        if used {
            self.place = 0;
            let _ = self.ends.stream_items.dequeue();
        }
    }

    #[cold]
    #[inline(never)]
    fn take_capture_command(&mut self, command: CaptureCommand<'a>) {
        match command {
            CaptureCommand::Record(capture) => self.capture = Some(capture),
            CaptureCommand::GiveBack => {
                if let Some(capture) = &mut self.capture {
                    capture.stop();
                }
                self.give_capture_back();
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn give_capture_back(&mut self) {
        if let Some(capture) = self.capture.take() {
            // There is one, so the queue has room for it.
            let _ = self.ends.captures.enqueue(capture);
        }
    }
}
