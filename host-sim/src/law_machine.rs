//! The law and its supervisor on the host, in the order in which the target runs them.

use std::collections::VecDeque;

use quadrant_law::admission::Refusal;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::cancelling::SpindleSpeed;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::reference::{Motion, ReferenceSample, Segment};
use quadrant_law::safety::Switches;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Inputs, Outputs, Plan, Stage, StageState};
use quadrant_law::supervisor::{Event, PERIOD_TICKS, Supervisor};
use quadrant_law::units::Position;
use quadrant_settings::Job;
use quadrant_settings::SettingsError;

/// Inputs of a machine in a tick: the law's inputs, and a person's request to the supervisor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickInput {
    /// The encoders' readings.
    pub readings: [EncoderReading; 3],
    /// The digital inputs.
    pub switches: Switches,
    /// True if the host that started the motion has fallen silent.
    pub link_lost: bool,
    /// The request.
    pub request: Option<Command>,
}

impl TickInput {
    /// Fresh and valid raw counts and a request: a stage without switches and index pulses.
    pub fn of_counts(counts: [u32; 3], request: Option<Command>) -> Self {
        Self {
            readings: counts.map(EncoderReading::of),
            request,
            ..Self::default()
        }
    }

    /// The law's inputs; the request goes to the supervisor.
    pub fn inputs(&self) -> Inputs {
        Inputs {
            readings: self.readings.into(),
            switches: self.switches,
            link_lost: self.link_lost,
            ..Inputs::default()
        }
    }
}

/// Control law, supervisor, and what passes between them.
#[derive(Clone, Debug)]
pub struct LawMachine<S: Scalar, const N: usize> {
    stage: Stage<S, N>,
    plan: Plan<S>,
    state: StageState<S, N>,
    supervisor: Supervisor,
    requests: VecDeque<Command>,
    /// Segments of a stream on their way to the axes.
    segments: [VecDeque<Segment>; 3],
    command: Option<Command>,
    /// True if y and z are left out.
    x_alone: bool,
    /// Axes whose settings were exchanged since the last tick.
    settings_changed: PerAxis<bool>,
    events: Vec<(u32, Event)>,
}

impl<S: Scalar, const N: usize> LawMachine<S, N> {
    /// A machine that is to run `job`.
    ///
    /// # Errors
    /// The first of the job's settings that is refused.
    pub fn new(job: &Job) -> Result<Self, SettingsError> {
        Ok(Self::with_plan(
            job.stage.build()?,
            job.plan.build(&job.stage)?,
        ))
    }

    /// A machine on built settings, with a plan that settings cannot hold, such as a recorded table.
    pub fn with_plan(stage: Stage<S, N>, plan: impl Into<Plan<S>>) -> Self {
        Self {
            stage,
            plan: plan.into(),
            state: StageState::default(),
            supervisor: Supervisor::default(),
            requests: VecDeque::new(),
            segments: Default::default(),
            command: None,
            x_alone: false,
            settings_changed: PerAxis::splat(false),
            events: Vec::new(),
        }
    }

    /// The same machine, whose axes y and z hold at zero and are left out: what x does is the same, in less time.
    /// [`Command::Run`] moves x.
    #[must_use]
    pub fn with_x_alone(mut self) -> Self {
        self.x_alone = true;
        self
    }

    /// The control law's memory.
    pub fn state(&self) -> &StageState<S, N> {
        &self.state
    }

    /// Returns the events of the supervisor, each with its control tick.
    pub fn events(&self) -> &[(u32, Event)] {
        &self.events
    }

    /// The last request that was refused, by its reason.
    pub fn refusal(&self) -> Option<Refusal> {
        let refused = |(_, event): &(u32, Event)| match event {
            Event::Refused(_, refusal) => Some(*refusal),
            _ => None,
        };
        self.events.iter().rev().find_map(refused)
    }

    /// Gives an axis of the plan another motion, for [`Command::StartMove`]. It must not be following the plan.
    pub fn set_motion(&mut self, axis: AxisName, motion: Motion<S>) {
        self.plan[axis as usize] = motion;
    }

    /// Leads an axis whose motion is given from elsewhere to its next sample, and shifts the feedback's reference.
    #[inline]
    pub(crate) fn lead(
        &mut self,
        axis: AxisName,
        sample: ReferenceSample<S>,
        correction: Option<Position>,
    ) {
        if let Motion::Given(place) = &mut self.plan[axis as usize] {
            *place = sample;
        }
        if let Some(by) = correction {
            self.stage
                .as_ref()
                .shift_reference(&mut self.state, axis, by);
        }
    }

    /// True if the plan starts in the next tick, unless the law refuses.
    pub(crate) fn starts_plan(&self) -> bool {
        matches!(self.command, Some(Command::Run | Command::StartMove(_)))
    }

    /// Sets the speed of the spindle.
    pub fn set_spindle_speed(&mut self, speed: SpindleSpeed) {
        self.state.set_spindle_speed(speed);
    }

    /// Takes other settings between two ticks, as the firmware does: the outputs go over without a jump.
    pub fn exchange(&mut self, stage: Stage<S, N>) {
        self.stage = stage;
        self.settings_changed = PerAxis::splat(true);
    }

    /// Appends a segment of each axis to the stream's queues.
    pub fn stream(&mut self, segments: [Segment; 3]) {
        for (queue, segment) in self.segments.iter_mut().zip(segments) {
            queue.push_back(segment);
        }
    }

    /// Segments of the stream that the slowest axis has not taken yet.
    pub fn queued_segments(&self) -> usize {
        self.segments.iter().map(VecDeque::len).max().unwrap_or(0)
    }

    fn feed_stream(&mut self) {
        for (name, queue) in AxisName::ALL.into_iter().zip(&mut self.segments) {
            // Few runs have a stream.
            if !queue.is_empty()
                && self.state.axes()[name as usize].wants_segment()
                && let Some(segment) = queue.pop_front()
            {
                self.state.offer_segment(name, &segment);
            }
        }
    }

    /// Runs one control period.
    pub fn tick(&mut self, input: &TickInput) -> Outputs {
        self.feed_stream();
        let inputs = Inputs {
            command: self.command.take(),
            settings_changed: std::mem::replace(&mut self.settings_changed, PerAxis::splat(false)),
            ..input.inputs()
        };
        let outputs = if self.x_alone {
            self.stage.tick_x(&self.plan, &mut self.state, &inputs)
        } else {
            self.stage.tick(&self.plan, &mut self.state, &inputs)
        };
        if let Some(request) = input.request {
            self.requests.push_back(match request {
                Command::Run if self.x_alone => Command::StartMove(AxisName::X),
                other => other,
            });
        }
        if self.state.tick().is_multiple_of(PERIOD_TICKS) {
            self.supervise();
        }
        outputs
    }

    fn supervise(&mut self) {
        let view = self.stage.as_ref().view(&self.plan, &self.state);
        let decision = self.supervisor.step(view, self.requests.pop_front());
        self.command = decision.command;
        let tick = self.state.tick();
        self.events.extend(
            decision
                .events
                .into_iter()
                .flatten()
                .map(|event| (tick, event)),
        );
    }
}

/// Requests at their ticks: what a person at the console would do.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Operator {
    script: VecDeque<(u32, Command)>,
}

/// Tick at which [`Operator::runs_the_plan`] enables.
const ENABLE_TICK: u32 = 100;
/// Tick at which it starts the plan.
const RUN_TICK: u32 = 200;

impl Operator {
    /// Enables, and starts the plan.
    pub fn runs_the_plan() -> Self {
        Self::follows([(ENABLE_TICK, Command::Enable), (RUN_TICK, Command::Run)])
    }

    /// Makes requests at their ticks, given in their order.
    pub fn follows(script: impl IntoIterator<Item = (u32, Command)>) -> Self {
        Self {
            script: script.into_iter().collect(),
        }
    }

    /// The request at a tick; ticks are asked for in order.
    pub fn request(&mut self, tick: u32) -> Option<Command> {
        self.script
            .pop_front_if(|(due, _)| *due <= tick)
            .map(|(_, command)| command)
    }
}
