//! Three axes, one tick: a pure function of settings, memory and inputs.
//!
//! ```
//! use quadrant_law::axes::PerAxis;
//! use quadrant_law::command::Command;
//! use quadrant_law::reference::Motion;
//! use quadrant_settings::StageSettings;
//! use quadrant_law::stage::{Inputs, Stage, StageState};
//!
//! let stage: Stage<f32> = StageSettings::simulated().build()?;
//! let plan = PerAxis::from_fn(|_| Motion::Hold);
//! let mut state = StageState::default();
//! let enable = Inputs { command: Some(Command::Enable), ..Inputs::default() };
//! assert!(stage.tick(&plan, &mut state, &enable).enabled);
//! # Ok::<(), quadrant_settings::SettingsError>(())
//! ```

use crate::admission::{self, StageView};
use crate::axes::{AxisName, PerAxis};
use crate::axis::{Axis, AxisState, Commissioning};
use crate::cancelling::SpindleSpeed;
use crate::command::Command;
use crate::encoder::EncoderReading;
use crate::friction::gms::FIRMWARE_ELEMENTS;
use crate::injection::{
    Coupling, InjectedValue, Injection, InjectionProgress, InjectionState, InjectionStep,
};
use crate::motion::MotionMode;
use crate::reference::{Motion, Segment};
use crate::safety::plausibility::is_due;
use crate::safety::standstill::StandstillState;
use crate::safety::{
    BrakeState, EnableInterlock, Fault, FaultCode, Operation, Reaction, SafetyState, Switches,
};
use crate::scalar::Scalar;
use crate::units::{DacCode, Position};

/// Ticks from the end of the stop ramps to switching off: the preview has passed, and the axes have caught up.
const SETTLING_TICKS: u32 = 200;

/// Inputs of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Readings of the encoders.
    pub readings: PerAxis<EncoderReading>,
    /// The board's digital inputs.
    pub switches: Switches,
    /// A command to act on, once.
    pub command: Option<Command>,
    /// The axes whose settings were exchanged since the last tick.
    pub settings_changed: PerAxis<bool>,
    /// This tick began late, or the last one ended after its deadline.
    pub deadline_missed: bool,
    /// The host that started the motion has fallen silent.
    pub link_lost: bool,
}

impl Inputs {
    /// Sets fresh and valid raw counts in place of the encoders' readings.
    pub fn set_counts(&mut self, counts: [u32; 3]) {
        self.readings = counts.map(EncoderReading::of).into();
    }

    /// Fresh and valid raw counts, and nothing else.
    #[inline(always)]
    pub fn of_counts(counts: [u32; 3]) -> Self {
        Self {
            readings: counts.map(EncoderReading::of).into(),
            ..Self::default()
        }
    }
}

/// Outputs of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The converters' words; zero unless enabled.
    pub codes: PerAxis<DacCode>,
    /// True if the amplifiers are enabled.
    pub enabled: bool,
    /// True if the holding brake has its current.
    pub brake_released: bool,
}

/// The motions that the axes run together.
pub type Plan<S> = PerAxis<Motion<S>>;

/// The stage ready for the tick; `N` is the room for GMS elements. `StageSettings::build` of the settings makes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    axes: PerAxis<Axis<S, N>>,
    operation: Operation,
}

/// A stage in pieces, so that one axis can be exchanged without moving the others.
#[derive(Clone, Copy, Debug)]
pub struct StageRef<'a, S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    /// The axes x, y and z.
    pub axes: PerAxis<&'a Axis<S, N>>,
    /// Rules of operation.
    pub operation: &'a Operation,
}

/// The memory of the stage. What is small comes first.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct StageState<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    safety: SafetyState,
    tick: u32,
    interlock: Option<EnableInterlock>,
    /// An axis that moves though the outputs are off.
    moving: Option<AxisName>,
    /// Tick in which it is judged again unless the outputs are driven.
    standstill_tick: u32,
    standstill: PerAxis<StandstillState>,
    held: Option<Fault>,
    /// Ticks since the axes came to rest after a fault.
    settled: u32,
    injection: InjectionState<S>,
    brake: BrakeState,
    /// The outputs are kept off: [`StageState::lock`].
    locked: bool,
    /// The stored settings are damaged or were refused.
    settings_invalid: bool,
    axes: PerAxis<AxisState<S, N>>,
}

/// The fault that each axis found in a tick, if any.
type Findings = PerAxis<Result<(), FaultCode>>;

impl<S: Scalar, const N: usize> Default for StageState<S, N> {
    fn default() -> Self {
        Self {
            axes: PerAxis::from_fn(|_| AxisState::default()),
            safety: SafetyState::default(),
            tick: 0,
            interlock: None,
            moving: None,
            standstill_tick: 0,
            standstill: PerAxis::splat(StandstillState::default()),
            held: None,
            settled: 0,
            injection: InjectionState::default(),
            brake: BrakeState::default(),
            locked: false,
            settings_invalid: false,
        }
    }
}

impl<S: Scalar, const N: usize> StageState<S, N> {
    /// A stage that starts with a fault latched: of the last run, or of the stored settings.
    pub fn with_fault(code: FaultCode) -> Self {
        let mut state = Self::default();
        state.start_faulted(code);
        state
    }

    /// As [`with_fault`](Self::with_fault), for a stage that has not ticked yet. [`FaultCode::SettingsInvalid`] stays until
    /// [`accept_settings`](Self::accept_settings), even if another fault is latched first.
    pub fn start_faulted(&mut self, code: FaultCode) {
        self.settings_invalid |= code == FaultCode::SettingsInvalid;
        if matches!(self.safety, SafetyState::Faulted(_)) {
            return;
        }
        self.safety = SafetyState::Faulted(Fault {
            code,
            axis: None,
            tick: 0,
        });
    }

    /// Keeps the outputs off until [`unlock`](Self::unlock), if they are off now: for what may not happen while they are
    /// on, such as the erasure of flash. Returns true if they are kept off.
    pub fn lock(&mut self) -> bool {
        self.locked |= !self.safety.drives();
        self.locked
    }

    /// Ends [`lock`](Self::lock).
    pub fn unlock(&mut self) {
        self.locked = false;
    }

    /// Takes note that valid settings were stored, or the stored ones erased: a reset clears
    /// [`FaultCode::SettingsInvalid`] from now on.
    pub fn accept_settings(&mut self) {
        self.settings_invalid = false;
    }

    /// The memories of x, y and z.
    pub fn axes(&self) -> &PerAxis<AxisState<S, N>> {
        &self.axes
    }

    /// The safety state after the last tick.
    pub fn safety(&self) -> SafetyState {
        self.safety
    }

    /// Control ticks so far; wraps after five days at 10 kHz.
    pub const fn tick(&self) -> u32 {
        self.tick
    }

    /// The bad input that keeps the outputs from being enabled at present, if there is one.
    pub fn interlock(&self) -> Option<EnableInterlock> {
        self.interlock
    }

    /// An axis that moves while the outputs are off: they are not enabled until it stands.
    pub fn moving(&self) -> Option<AxisName> {
        self.moving
    }

    /// The last fault that only held the axes ([`Reaction::Hold`]), until the next motion.
    pub fn held(&self) -> Option<Fault> {
        self.held
    }

    /// True while any motion is under way.
    pub fn is_running(&self) -> bool {
        self.injection.is_running() || self.axes.iter().any(AxisState::is_running)
    }

    /// Gives an axis the next segment of a stream; call it when [`AxisState::wants_segment`].
    pub fn offer_segment(&mut self, axis: AxisName, segment: &Segment) {
        self.axes[axis].offer_segment(segment);
    }

    /// Sets the speed of the spindle for the axes that cancel its vibration.
    pub fn set_spindle_speed(&mut self, speed: SpindleSpeed) {
        for axis in &mut *self.axes {
            axis.set_spindle_speed(speed);
        }
    }

    /// Puts an axis' travel into force, or out of it: for absolute encoders. Homing does it by itself.
    pub fn set_homed(&mut self, axis: AxisName, homed: bool) {
        self.axes[axis].set_homed(homed);
    }

    /// Takes an injection; it begins with [`Command::StartInjection`], once its first value is there.
    pub fn prepare_injection(&mut self, injection: Injection<S>) {
        self.injection.prepare(injection);
    }

    /// True if there is an injection, so that its values are needed.
    pub fn has_injection(&self) -> bool {
        self.injection.is_prepared()
    }

    /// True if the injection has room for a value.
    pub fn wants_voltage(&self) -> bool {
        self.injection.wants_value()
    }

    /// Gives the injection its next value; call it when [`StageState::wants_voltage`].
    pub fn push_injection(&mut self, value: InjectedValue) {
        self.injection.offer(value);
    }

    /// True if an injection can begin.
    pub(crate) fn is_injection_ready(&self) -> bool {
        self.injection.is_ready()
    }

    /// True while an injection is under way.
    pub fn is_injecting(&self) -> bool {
        self.injection.is_running()
    }

    /// Progress of the injection under way, or else of the last one.
    pub fn injection_progress(&self) -> InjectionProgress {
        self.injection.progress()
    }
}

impl<S: Scalar, const N: usize> StageRef<'_, S, N> {
    /// The view of the stage as its last tick left it, with the plan that it would run.
    #[inline(always)]
    pub fn view(&self, plan: &Plan<S>, state: &StageState<S, N>) -> StageView {
        let inert = self
            .axes
            .map(|axis| axis.commissioning() == Commissioning::Inert);
        let first = |moves: PerAxis<bool>| {
            let mut axes = AxisName::ALL.into_iter();
            axes.find(|&name| inert[name] && moves[name])
        };
        let planned = first(plan.by_ref().map(|motion| !matches!(motion, Motion::Hold)));
        let injection = state.injection.injection();
        let with_plan = injection.is_some_and(|own| own.coupling() == Coupling::WithPlan);
        StageView {
            safety: state.safety(),
            running: state.is_running(),
            interlock: state.interlock(),
            moving: state.moving(),
            awaiting_homing: self
                .axes
                .zip(state.axes.by_ref())
                .map(|(axis, memory)| axis.awaits_homing(memory)),
            held: state.held(),
            modes: state.axes.by_ref().map(AxisState::mode),
            homed: state.axes.by_ref().map(AxisState::is_homed),
            stream_ready: state.axes.iter().all(AxisState::is_stream_ready),
            injection_ready: state.is_injection_ready() && self.may_inject(state),
            injecting: state.is_injecting(),
            commissioned: self.is_commissioned(),
            uncommissioned: self.uncommissioned(),
            inert,
            inert_planned: planned,
            inert_streamed: first(state.axes.by_ref().map(AxisState::is_streamed_away)),
            inert_injected: planned.filter(|_| with_plan),
            brake_moves: state.brake.is_moving(),
            enabled_by: self.operation.enabled_by,
            locked: state.locked,
            settings_invalid: state.settings_invalid,
        }
    }

    /// True if the axis of the injection that waits, should there be one, was commissioned.
    fn may_inject(&self, state: &StageState<S, N>) -> bool {
        let injection = state.injection.injection();
        injection.is_none_or(|injection| {
            self.axes[injection.axis()].commissioning() == Commissioning::Done
        })
    }

    /// Puts the feedback's reference of the next tick where a planner of the board's has it, if the axis follows its plan: to be
    /// called before every tick with [`Motion::Given`].
    pub fn place_reference(&self, state: &mut StageState<S, N>, name: AxisName, now: Position) {
        let (axis, memory, tick) = (self.axes[name], &mut state.axes[name], state.tick);
        if memory.mode() == MotionMode::Plan {
            axis.place_reference(memory, now, tick);
        }
    }

    /// Shifts the feedback's reference of the next tick from where the feedforward's was before the preview, if the axis follows its
    /// plan and has a preview: to be called before every tick with [`Motion::Given`].
    pub fn shift_reference(&self, state: &mut StageState<S, N>, name: AxisName, by: Position) {
        let (axis, memory, tick) = (self.axes[name], &mut state.axes[name], state.tick);
        if memory.mode() == MotionMode::Plan {
            axis.shift_reference(memory, by, tick);
        }
    }

    /// Reacts to a fault that a planner of the board's has found, before a tick.
    pub fn report_fault(&self, state: &mut StageState<S, N>, name: AxisName, code: FaultCode) {
        self.trip(state, code, Some(name), state.tick);
    }

    /// True if an axis was commissioned, and no other has a law that could drive it.
    #[inline(always)]
    pub fn is_commissioned(&self) -> bool {
        let mut axes = self.axes.iter();
        axes.any(|axis| axis.commissioning() == Commissioning::Done)
            && self.uncommissioned().is_none()
    }

    /// The first axis that has a law and was not commissioned.
    #[inline(always)]
    fn uncommissioned(&self) -> Option<AxisName> {
        let mut axes = AxisName::ALL.into_iter();
        axes.find(|&name| self.axes[name].commissioning() == Commissioning::Missing)
    }
}

impl<S: Scalar, const N: usize> Stage<S, N> {
    /// A stage of three axes.
    pub fn new(axes: PerAxis<Axis<S, N>>, operation: Operation) -> Self {
        Self { axes, operation }
    }

    /// The stage in pieces.
    #[inline(always)]
    pub fn as_ref(&self) -> StageRef<'_, S, N> {
        StageRef {
            axes: self.axes.by_ref(),
            operation: &self.operation,
        }
    }

    /// The axes themselves, and what belongs to the stage beside them.
    pub fn into_axes(self) -> (PerAxis<Axis<S, N>>, Operation) {
        (self.axes, self.operation)
    }

    /// One axis, to be put in the place of another in a [`StageRef`].
    pub fn axis(&self, axis: AxisName) -> &Axis<S, N> {
        &self.axes[axis]
    }

    /// One control period; see [`StageRef::tick`].
    pub fn tick(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        self.as_ref().tick(plan, state, inputs)
    }

    /// One control period of x alone; see [`StageRef::tick_x`].
    pub fn tick_x(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        self.as_ref().tick_x(plan, state, inputs)
    }
}

impl<S: Scalar, const N: usize> StageRef<'_, S, N> {
    /// One control period.
    ///
    /// A fault found in this tick switches the outputs off in this tick, or begins a controlled stop, as its
    /// [`Reaction`] says. No path panics, allocates, or loops without a bound; every operation saturates.
    pub fn tick(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        self.tick_axes::<true>(plan, state, inputs)
    }

    /// One control period of x alone, for a host that simulates no other axis: y and z are neither read nor driven, so
    /// they must hold, and nothing but [`Command::StartMove`] of x may start a motion.
    pub fn tick_x(&self, plan: &Plan<S>, state: &mut StageState<S, N>, inputs: &Inputs) -> Outputs {
        self.tick_axes::<false>(plan, state, inputs)
    }

    /// One control period of all axes, or of x alone.
    #[inline(always)]
    fn tick_axes<const ALL: bool>(
        &self,
        plan: &Plan<S>,
        state: &mut StageState<S, N>,
        inputs: &Inputs,
    ) -> Outputs {
        let tick = state.tick;
        state.tick = tick.wrapping_add(1);
        let driven = state.safety.drives();
        let [x, y, z] = self.axes.into_array();
        let [of_x, of_y, of_z] = &mut *state.axes;
        let [at_x, at_y, at_z] = &*inputs.readings;
        let mut findings = Findings::splat(Ok(()));
        findings[AxisName::X] = x.read_encoder(of_x, at_x, is_due(tick, 0));
        if ALL {
            findings[AxisName::Y] = y.read_encoder(of_y, at_y, is_due(tick, 1));
            findings[AxisName::Z] = z.read_encoder(of_z, at_z, is_due(tick, 2));
        }
        state.interlock = None;
        if !(inputs.switches.are_good() & is_empty(&findings)) {
            self.report_bad_inputs(state, inputs.switches, findings, tick);
        }
        if inputs.deadline_missed && driven {
            self.trip(state, FaultCode::DeadlineMissed, None, tick);
        }
        if inputs.link_lost && state.is_running() {
            self.trip(state, FaultCode::LinkLost, None, tick);
        }
        if state.safety == SafetyState::Start && state.interlock.is_none() {
            state.safety = SafetyState::Disabled;
        }
        state.moving = if driven {
            None
        } else {
            self.moving(state, tick)
        };
        if let Some(command) = inputs.command {
            self.handle_command(plan, state, command, driven, tick);
        }
        if state.brake.is_moving() {
            turn_brake(state);
        }
        if state.injection.is_running() {
            self.inject(state, tick);
        }
        if state.safety.drives() {
            self.update_references::<ALL>(plan, state, inputs.switches, tick);
        }
        if !state.safety.drives() {
            state.injection.end();
            state.brake = BrakeState::Applied;
            let changed = &inputs.settings_changed;
            for ((axis, memory), changed) in self.axes.into_iter().zip(&mut state.axes).zip(changed)
            {
                axis.output_zero(memory, *changed);
            }
            return Outputs::default();
        }
        let [of_x, of_y, of_z] = &mut *state.axes;
        let [new_x, new_y, new_z] = inputs.settings_changed.into_array();
        let mut codes = PerAxis::splat(DacCode::ZERO);
        codes[AxisName::X] = x.drive(of_x, new_x);
        if ALL {
            codes[AxisName::Y] = y.drive(of_y, new_y);
            codes[AxisName::Z] = z.drive(of_z, new_z);
        }
        Outputs {
            codes,
            enabled: true,
            brake_released: state.brake.has_current(),
        }
    }

    /// The first axis that does not stand.
    fn moving(&self, state: &mut StageState<S, N>, tick: u32) -> Option<AxisName> {
        let begins = state.standstill_tick != tick;
        state.standstill_tick = tick.wrapping_add(1);
        let mut moving = None;
        for (((axis, memory), standstill), name) in self
            .axes
            .into_iter()
            .zip(&state.axes)
            .zip(&mut state.standstill)
            .zip(AxisName::ALL)
        {
            let stands = axis.stands(memory, standstill, begins);
            if !stands && moving.is_none() {
                moving = Some(name);
            }
        }
        moving
    }

    /// Advances the references of driven axes, all of them or x alone.
    #[inline(always)]
    fn update_references<const ALL: bool>(
        &self,
        plan: &Plan<S>,
        state: &mut StageState<S, N>,
        switches: Switches,
        tick: u32,
    ) {
        let [x, y, z] = self.axes.into_array();
        let [of_x, of_y, of_z] = &mut *state.axes;
        let [to_x, to_y, to_z] = &**plan;
        let at = |axis| switches.axis(axis);
        let mut findings = Findings::splat(Ok(()));
        findings[AxisName::X] = x.update_reference(of_x, to_x, at(AxisName::X), tick);
        if ALL {
            findings[AxisName::Y] = y.update_reference(of_y, to_y, at(AxisName::Y), tick);
            findings[AxisName::Z] = z.update_reference(of_z, to_z, at(AxisName::Z), tick);
        }
        if !is_empty(&findings) {
            self.trip_findings(state, findings, tick);
        }
        if let SafetyState::Stopping(fault) = state.safety {
            self.settle(state, fault);
        }
    }

    /// Keeps the first bad input as the interlock, and makes a fault of it if the outputs are driven.
    #[cold]
    #[inline(never)]
    fn report_bad_inputs(
        &self,
        state: &mut StageState<S, N>,
        switches: Switches,
        findings: Findings,
        tick: u32,
    ) {
        state.interlock = switches.interlock();
        for (name, finding) in findings.named() {
            if let Err(code) = *finding
                && matches!(code, FaultCode::StaleSample | FaultCode::EncoderInvalid)
                && state.interlock.is_none()
            {
                state.interlock = Some(EnableInterlock {
                    code,
                    axis: Some(name),
                });
            }
        }
        // The emergency stop goes first; should it brake, what switches off beside it still does.
        if switches.emergency_stop() {
            self.trip(state, FaultCode::EmergencyStop, None, tick);
        }
        for axis in AxisName::ALL {
            if let Some(code) = switches.axis(axis).fault() {
                self.trip(state, code, Some(axis), tick);
            }
        }
        self.trip_findings(state, findings, tick);
    }

    /// Makes faults of what the axes found. One that switches off goes before one that stops.
    #[cold]
    #[inline(never)]
    fn trip_findings(&self, state: &mut StageState<S, N>, findings: Findings, tick: u32) {
        for first in [Reaction::Off, Reaction::Stop, Reaction::Hold] {
            for (name, finding) in findings.named() {
                if let Err(code) = *finding
                    && self.operation.reaction(code) == first
                {
                    self.trip(state, code, Some(name), tick);
                }
            }
        }
    }

    /// Reacts to a fault, if the outputs are driven.
    #[cold]
    #[inline(never)]
    fn trip(
        &self,
        state: &mut StageState<S, N>,
        code: FaultCode,
        axis: Option<AxisName>,
        tick: u32,
    ) {
        if !state.safety.drives() {
            return;
        }
        let fault = Fault { code, axis, tick };
        let reaction = self.operation.reaction(code);
        let was_enabled = state.safety.is_enabled();
        state.safety.trip(fault, reaction);
        if !was_enabled || reaction == Reaction::Off {
            return;
        }
        state.settled = 0;
        if reaction == Reaction::Hold && state.held.is_none() {
            state.held = Some(fault);
        }
        self.end_injection(state);
        for (axis, memory) in self.axes.into_iter().zip(&mut state.axes) {
            axis.stop(memory);
        }
    }

    /// Acts on a command. `driven`: the outputs were when the tick began.
    #[cold]
    #[inline(never)]
    fn handle_command(
        &self,
        plan: &Plan<S>,
        state: &mut StageState<S, N>,
        command: Command,
        driven: bool,
        tick: u32,
    ) {
        // A reset is for a fault that was there to be seen, not for one of this tick.
        if driven && command == Command::ResetFault {
            return;
        }
        // The task that let it through saw an older state.
        if admission::refusal(self.view(plan, state), command).is_some() {
            return;
        }
        // Held by the law until the brake holds; asked a second time, or in motion, at once.
        if command == Command::Disable
            && state.safety.is_enabled()
            && !state.is_running()
            && !state.brake.is_moving()
            && state.brake.apply(self.operation.brake)
        {
            return;
        }
        if state.safety.apply(command) {
            state.brake.release(self.operation.brake);
            state.moving = None;
            state.held = None;
            for (axis, memory) in self.axes.into_iter().zip(&mut state.axes) {
                axis.hold_here(memory);
            }
        } else if state.safety.is_enabled() {
            self.start(plan, state, command, tick);
        }
    }

    /// Starts or ends motions of an enabled stage, as an admitted command says.
    fn start(&self, plan: &Plan<S>, state: &mut StageState<S, N>, command: Command, tick: u32) {
        match command {
            Command::Enable | Command::Disable | Command::ResetFault => return,
            Command::Stop => self.end_injection(state),
            _ => state.held = None,
        }
        if command == Command::StartInjection {
            self.start_injection(plan, state, tick);
            return;
        }
        for ((axis, memory), name) in self
            .axes
            .into_iter()
            .zip(&mut state.axes)
            .zip(AxisName::ALL)
        {
            if command.axis().is_some_and(|only| only != name) {
                continue;
            }
            if matches!(command, Command::Run | Command::StartMove(_)) {
                axis.run(memory, &plan[name]);
            } else {
                axis.handle_command(memory, command);
            }
        }
    }

    /// Ends a stop once the axes stand and the brake holds: its fault is latched.
    #[cold]
    #[inline(never)]
    fn settle(&self, state: &mut StageState<S, N>, fault: Fault) {
        if state.is_running() {
            return;
        }
        state.settled = state.settled.saturating_add(1);
        if state.settled > SETTLING_TICKS && !state.brake.apply(self.operation.brake) {
            state.safety = SafetyState::Faulted(fault);
        }
    }

    /// Begins the injection that is ready.
    fn start_injection(&self, plan: &Plan<S>, state: &mut StageState<S, N>, tick: u32) {
        let Some(injection) = state.injection.injection() else {
            return;
        };
        let (name, coupling) = (injection.axis(), injection.coupling());
        state.injection.begin(tick, state.axes[name].measured());
        match coupling {
            Coupling::Added => {}
            Coupling::OpenLoop => self.axes[name].open_loop(&mut state.axes[name]),
            Coupling::WithPlan => {
                for ((axis, memory), motion) in self.axes.into_iter().zip(&mut state.axes).zip(plan)
                {
                    axis.run(memory, motion);
                }
            }
        }
    }

    /// Takes the injected voltage of this tick.
    #[cold]
    #[inline(never)]
    fn inject(&self, state: &mut StageState<S, N>, tick: u32) {
        let Some(name) = state.injection.injection().map(Injection::axis) else {
            return;
        };
        let memory = &mut state.axes[name];
        match state.injection.step(memory.measured(), memory.speed()) {
            InjectionStep::Voltage(voltage) => memory.inject(voltage),
            InjectionStep::Finished => self.end_injection(state),
            InjectionStep::Fault(code) => self.trip(state, code, Some(name), tick),
        }
    }

    /// Ends an injection, if one is under way: no voltage more, and the loop closed, stopping from the motion that the
    /// axis has.
    fn end_injection(&self, state: &mut StageState<S, N>) {
        if let Some(injection) = state.injection.end() {
            let name = injection.axis();
            self.axes[name].end_injection(&mut state.axes[name]);
        }
    }
}

/// True if no axis found anything.
fn is_empty(findings: &Findings) -> bool {
    let [x, y, z] = &**findings;
    x.is_ok() & y.is_ok() & z.is_ok()
}

/// Lets a tick of the brake's time pass, and switches off when it holds.
#[cold]
#[inline(never)]
fn turn_brake<S: Scalar, const N: usize>(state: &mut StageState<S, N>) {
    if state.brake.step() {
        state.safety.apply(Command::Disable);
    }
}
