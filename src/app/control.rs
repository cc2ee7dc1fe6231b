//! The fast half: the state and the work of the control interrupt.

use super::glitch_monitor::GlitchReadings;
use super::host_need::HostNeed;
use super::queues::{AxisSwap, CaptureCommand, ControlEnds, Order, StreamItem};
use super::{Axis, Snapshot};
use crate::app::capture::Capture;
use crate::app::telemetry::{Observation, Sampler, SamplerState};
use quadrant_law::admission::{self, Refusal};
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::command::Command;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::reference::{Motion, ReferenceSample};
use quadrant_law::safety::{FaultCode, Operation, Station, Switches};
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Inputs, Outputs, Plan, StageRef, StageState};
use quadrant_law::supervisor::PERIOD_TICKS;
use quadrant_law::units::Position;

/// Everything that the control interrupt owns. What is small comes first.
#[repr(C)]
pub struct Control<'q, 'a, S: Scalar> {
    axes: PerAxis<&'a mut Axis<S>>,
    operation: Operation,
    sampler: Sampler,
    sampling: SamplerState,
    capture: Option<Capture<'a>>,
    glitches: GlitchReadings,
    commanded: bool,
    /// The inputs of the last tick.
    switches: Switches,
    /// Some axes have new settings that others have not yet.
    exchanging: bool,
    /// Values of the first waiting block that were taken.
    place: usize,
    /// Orders taken so far; wraps.
    orders: u16,
    /// Axes exchanged so far; wraps.
    exchanges: u16,
    /// The last order to exchange the plan was carried out.
    plan_taken: bool,
    /// The axes whose motion in the plan is a move of their own, and what the plan has for them.
    moved: PerAxis<bool>,
    behind_moves: Plan<S>,
    host: HostNeed,
    ends: ControlEnds<'q, 'a, S>,
    plan: Plan<S>,
    state: StageState<S, FIRMWARE_ELEMENTS>,
}

impl<'q, 'a, S: Scalar> Control<'q, 'a, S> {
    /// Returns the fast half before the first tick, for a control rate.
    #[inline(always)]
    pub fn new(
        axes: PerAxis<&'a mut Axis<S>>,
        operation: Operation,
        plan: Plan<S>,
        rate_hz: u32,
        ends: ControlEnds<'q, 'a, S>,
    ) -> Self {
        Self {
            axes,
            operation,
            plan,
            state: StageState::default(),
            sampler: Sampler::default(),
            sampling: SamplerState::default(),
            capture: None,
            glitches: GlitchReadings::default(),
            commanded: false,
            switches: Switches::NONE,
            exchanging: false,
            place: 0,
            orders: 0,
            exchanges: 0,
            plan_taken: false,
            moved: PerAxis::splat(false),
            behind_moves: no_motion(),
            host: HostNeed::new(rate_hz),
            ends,
        }
    }

    /// Starts with a fault latched, before the first tick: what the last run or the stored settings left. The first stays.
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

    /// The reason for which the law would refuse a command now.
    pub(super) fn refusal(&self, command: Command) -> Option<Refusal> {
        admission::refusal(self.stage().view(&self.plan, &self.state), command)
    }

    /// Receives the number of valid requests of a host so far, from [`Intake::frames`](super::Intake::frames). Once a tick.
    #[inline(always)]
    pub fn note_requests(&mut self, frames: u32) {
        self.host.note_requests(frames);
    }

    /// Sets the reference of an axis that a planner of the board's leads, before a tick: where it will be after the axis' preview,
    /// and where the feedback's is `now`, unless that is what the former was before the preview. The axis follows it from
    /// [`Command::StartMove`] on.
    pub fn lead(&mut self, name: AxisName, now: Option<Position>, ahead: ReferenceSample<S>) {
        self.plan[name] = Motion::Given(ahead);
        self.moved[name] = false;
        if let Some(now) = now {
            let stage = stage_of(&self.axes, &self.operation);
            stage.place_reference(&mut self.state, name, now);
        }
    }

    /// Shifts the feedback's reference of an axis that is led in the next tick.
    pub(super) fn shift_reference(&mut self, name: AxisName, by: Position) {
        let stage = stage_of(&self.axes, &self.operation);
        stage.shift_reference(&mut self.state, name, by);
    }

    /// Reacts to a fault that a planner of the board's has found in an axis that it leads, before a tick.
    pub(super) fn report_fault(&mut self, name: AxisName, code: FaultCode) {
        let stage = stage_of(&self.axes, &self.operation);
        stage.report_fault(&mut self.state, name, code);
    }

    /// Ends [`lead`](Self::lead): a plan of a host moves the axis again.
    pub fn release(&mut self, name: AxisName) {
        self.plan[name] = Motion::Hold;
    }

    /// One control period: takes what the server has sent, and computes the outputs. It adds to the inputs: the settings'
    /// changes are its own to report, and an order of the server's acts when they have no command.
    #[inline(always)]
    pub fn tick(&mut self, inputs: &mut Inputs) -> Outputs {
        let mut unfit = false;
        if self.ends.swaps.ready() {
            inputs.settings_changed = self.take_swap();
            // Settings that are not those of a commissioned stage do not drive it on.
            unfit = !self.stage().is_commissioned();
        }
        match self.ends.stream_items.peek() {
            None => {}
            Some(StreamItem::Segments(_)) => self.take_segments(),
            Some(StreamItem::Injection(_) | StreamItem::Voltages(_)) => self.take_voltage(),
        }
        if unfit || inputs.command.is_some() || self.ends.orders.ready() {
            self.choose_command(&mut inputs.command, unfit);
        }
        if self.host.is_needed() {
            inputs.link_lost |= self.host.is_lost();
        }
        self.commanded = inputs.command.is_some();
        self.switches = inputs.switches;
        let stage = stage_of(&self.axes, &self.operation);
        let outputs = stage.tick(&self.plan, &mut self.state, inputs);
        if self.host.is_needed() {
            self.host.update(&self.state);
        }
        if self.moved.contains(&true) {
            self.end_moves();
        }
        outputs
    }

    /// The stage.
    #[inline(always)]
    pub fn stage(&self) -> StageRef<'_, S> {
        stage_of(&self.axes, &self.operation)
    }

    /// Samples telemetry and capture after the outputs are written. Returns true if the supervising task's [`snapshot`] is
    /// due.
    ///
    /// [`snapshot`]: Self::snapshot
    #[inline(always)]
    pub fn observe(&mut self, elapsed_cycles: u32) -> bool {
        if self.ends.samplers.ready() {
            self.take_sampler();
        }
        if self.ends.capture_commands.ready() {
            self.take_capture_command();
        }
        let seen = Observation {
            stage: &self.state,
            glitches: &self.glitches,
            elapsed_cycles,
            commanded: self.commanded,
        };
        if let Some(sample) = self.sampler.step(&mut self.sampling, &seen) {
            // A full queue drops the newest; its number is missing, so that the server detects the loss.
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

    /// The supervising task's view of the last tick.
    pub fn snapshot(&self) -> Snapshot<S> {
        let mut snapshot = Snapshot::default();
        self.take_snapshot(&mut snapshot);
        snapshot
    }

    /// Puts the supervising task's view of the last tick in the place of an older one.
    #[inline(never)]
    pub fn take_snapshot(&self, snapshot: &mut Snapshot<S>) {
        snapshot.renew(&self.stage(), &self.plan, &self.state);
        snapshot.switches = self.switches;
        snapshot.orders = self.orders;
        snapshot.exchanges = self.exchanges;
        snapshot.plan_taken = self.plan_taken;
        snapshot.planned = self.plan.iter().any(|motion| *motion != Motion::Hold);
    }

    /// Chooses the command of this tick. `unfit`: the settings are no longer those of a commissioned stage.
    #[cold]
    #[inline(never)]
    fn choose_command(&mut self, given: &mut Option<Command>, unfit: bool) {
        let command = match *given {
            _ if unfit => Some(Command::Disable),
            Some(command) => {
                self.overtake(command);
                self.admit(Station::Operator, command)
            }
            None => match self.ends.orders.dequeue() {
                Some(order) => self.take_order(order),
                None => None,
            },
        };
        *given = command.filter(|command| *command != Command::Enable || !self.exchanging);
    }

    /// Acts on an order of the server; returns the command that it is or brings about.
    #[cold]
    #[inline(never)]
    fn take_order(&mut self, order: Order) -> Option<Command> {
        self.orders = self.orders.wrapping_add(1);
        let command = match order {
            Order::Command(command) => command,
            Order::Move(name) => {
                let plan = self.ends.plans.dequeue()?;
                if self.state.axes()[name].is_running() {
                    return None;
                }
                if !self.moved[name] {
                    self.moved[name] = true;
                    self.behind_moves[name] = self.plan[name].clone();
                }
                self.plan[name] = plan[name].clone();
                Command::StartMove(name)
            }
            Order::Plan => {
                let plan = self.ends.plans.dequeue()?;
                self.plan_taken = !self.state.is_running();
                if self.plan_taken {
                    self.plan = plan;
                    self.moved = PerAxis::splat(false);
                }
                return None;
            }
            Order::Spindle(speed) => {
                self.state.set_spindle_speed(speed);
                return None;
            }
            Order::Lock => {
                self.state.lock();
                return None;
            }
            Order::Unlock { stored } => {
                self.state.unlock();
                if stored {
                    self.state.accept_settings();
                }
                return None;
            }
        };
        let needed = self.operation.host_needed;
        self.host.start(command, needed, &self.plan);
        self.admit(Station::Host, command)
    }

    /// Gives axes whose moves have ended their motion in the plan back: `Run` repeats no move.
    #[cold]
    #[inline(never)]
    fn end_moves(&mut self) {
        for name in AxisName::ALL {
            if self.moved[name] && !self.state.axes()[name].is_running() {
                self.moved[name] = false;
                core::mem::swap(&mut self.plan[name], &mut self.behind_moves[name]);
            }
        }
    }

    /// Returns the command, unless it would enable and the settings in force do not allow that to its station.
    fn admit(&self, station: Station, command: Command) -> Option<Command> {
        let allowed = command != Command::Enable || self.operation.enabled_by.allows(station);
        allowed.then_some(command)
    }

    /// Drops the server's orders that were waiting when a command to stop or to disable came by the shorter way: nothing
    /// that was asked for earlier starts after it.
    #[cold]
    #[inline(never)]
    fn overtake(&mut self, command: Command) {
        if !matches!(command, Command::Stop | Command::Disable) {
            return;
        }
        // As many as wait now: the server may be adding more.
        for _ in 0..self.ends.orders.len() {
            let Some(order) = self.ends.orders.dequeue() else {
                return;
            };
            match order {
                Order::Command(_) | Order::Move(_) => {
                    self.orders = self.orders.wrapping_add(1);
                    if matches!(order, Order::Move(_)) {
                        let _ = self.ends.plans.dequeue();
                    }
                }
                Order::Plan | Order::Spindle(_) | Order::Lock | Order::Unlock { .. } => {
                    self.take_order(order);
                }
            }
        }
    }

    /// Replaces an axis, if it may be replaced now.
    #[cold]
    #[inline(never)]
    fn take_swap(&mut self) -> PerAxis<bool> {
        let driven = self.state.safety().drives();
        match self.ends.swaps.peek() {
            Some(swap) if swap.needs_disabled && driven => PerAxis::splat(false),
            _ => match self.ends.swaps.dequeue() {
                Some(swap) => self.swap(swap),
                None => PerAxis::splat(false),
            },
        }
    }

    /// Replaces an axis; the old one goes back to the server as its back buffer.
    fn swap(&mut self, swap: AxisSwap<'a, S>) -> PerAxis<bool> {
        let AxisSwap {
            name,
            axis,
            operation,
            needs_disabled,
            more,
            new_origin,
        } = swap;
        self.exchanges = self.exchanges.wrapping_add(1);
        self.exchanging = needs_disabled && more;
        if needs_disabled {
            // It was checked against the settings that acted until now. What is left of a stream or of an injection begins nothing.
            self.plan = no_motion();
            self.moved = PerAxis::splat(false);
        }
        if new_origin {
            self.state.set_homed(name, false);
        }
        // There is one back buffer, so the queue has room for it.
        let replaced = core::mem::replace(&mut self.axes[name], axis);
        let _ = self.ends.back_buffers.enqueue(replaced);
        self.operation = operation;
        PerAxis::from_fn(|axis| axis == name)
    }

    /// Passes the axes the next segments of a stream, if they have room.
    #[cold]
    #[inline(never)]
    fn take_segments(&mut self) {
        if self.state.axes().iter().all(|axis| axis.wants_segment())
            && let Some(StreamItem::Segments(segments)) = self.ends.stream_items.peek()
        {
            for (name, segment) in AxisName::ALL.into_iter().zip(segments) {
                self.state.offer_segment(name, segment);
            }
            // Each was copied once, from its place in the queue to its slot. What is taken out here is not read.
            let _ = self.ends.stream_items.dequeue();
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
                    self.state.push_injection(value);
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
    fn take_sampler(&mut self) {
        if let Some(sampler) = self.ends.samplers.dequeue() {
            self.sampler = sampler;
        }
    }

    #[cold]
    #[inline(never)]
    fn take_capture_command(&mut self) {
        match self.ends.capture_commands.dequeue() {
            None => {}
            Some(CaptureCommand::Record(capture)) => self.capture = Some(capture),
            Some(CaptureCommand::GiveBack) => {
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

/// A plan that moves nothing.
fn no_motion<S: Scalar>() -> Plan<S> {
    PerAxis::from_fn(|_| Motion::Hold)
}

/// The stage in pieces; of the fields by themselves, so that the tick may change others meanwhile.
#[inline(always)]
fn stage_of<'a, S: Scalar>(
    axes: &'a PerAxis<&mut Axis<S>>,
    operation: &'a Operation,
) -> StageRef<'a, S> {
    let axes = axes.each_ref().map(|axis| &**axis);
    StageRef {
        axes: axes.into(),
        operation,
    }
}
