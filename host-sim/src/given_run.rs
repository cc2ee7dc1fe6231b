//! Runs on references from elsewhere: positions in memory instead of a plan of settings.
//!
//! One axis alone, or the three of a stage. A run is advanced some ticks at a time, so that a caller can look elsewhere between.

use std::sync::Arc;

use quadrant_law::axes::AxisName;
use quadrant_law::axis::AxisState;
use quadrant_law::axis::telemetry::LimitedBy;
use quadrant_law::command::Command;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{
    FollowedPulses, Motion, MotionScale, MotionSettings, MotionState, ReferenceSample,
};
use quadrant_law::safety::SafetyState;
use quadrant_law::stage::{Outputs, Plan};
use quadrant_law::units::{POSITION_FRACTION_BITS, Position};
use quadrant_settings::{BrakeSettings, OperationSettings, SettingsError, StageSettings};

use crate::law_machine::{LawMachine, TickInput};
use crate::plant::{SimulatedAxis, SimulatedStage, StageParameters};
use crate::run::RunError;

/// Reference of an axis, a sample a control period, from where the axis stands. Copies share the samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenReference {
    samples: Arc<[ReferenceSample<f32>]>,
    /// Distances from the feedback's reference, a sample of the preview ago; none, or as many as samples.
    corrections: Arc<[Position]>,
}

impl GivenReference {
    /// The reference through positions, mm, counted from the first; velocity and acceleration are their central differences.
    pub fn through(positions_mm: &[f64], scale: MotionScale) -> Self {
        let last = positions_mm.len().saturating_sub(1);
        let at = |index: usize| positions_mm[index.min(last)];
        let rate_hz = scale.rate_hz;
        let derivatives = (0..positions_mm.len()).map(|index| {
            let (before, here, after) = (at(index.saturating_sub(1)), at(index), at(index + 1));
            let velocity = 0.5 * (after - before) * rate_hz;
            (velocity, (after - 2.0 * here + before) * rate_hz * rate_hz)
        });
        Self::with(positions_mm, derivatives, scale)
    }

    /// The same with velocities, mm/s, and accelerations, mm/s², of its own: as many of each as of positions.
    pub fn with(
        positions_mm: &[f64],
        derivatives: impl IntoIterator<Item = (f64, f64)>,
        scale: MotionScale,
    ) -> Self {
        let first_mm = positions_mm.first().copied().unwrap_or(0.0);
        let samples = positions_mm.iter().zip(derivatives);
        Self {
            samples: samples
                .map(|(position_mm, (velocity, acceleration))| ReferenceSample {
                    position: Position::from_mm(position_mm - first_mm, scale.resolution_mm),
                    velocity: velocity as f32,
                    acceleration: acceleration as f32,
                })
                .collect(),
            corrections: Arc::default(),
        }
    }

    /// The reference of a motion as the firmware makes it, until the motion ends, or for `most_ticks`.
    pub fn of_motion(settings: &MotionSettings, scale: MotionScale, most_ticks: usize) -> Self {
        let motion = Motion::<f32>::build(settings, scale);
        let mut state = MotionState::start(Position::ZERO);
        let mut samples = Vec::new();
        while samples.len() < most_ticks && !motion.finished(&state) {
            samples.push(motion.step(&mut state));
        }
        Self {
            samples: samples.into(),
            corrections: Arc::default(),
        }
    }

    /// The reference of counted pulses, from the position at which the first is counted.
    pub fn of_pulses(followed: &[FollowedPulses<f32>]) -> Self {
        Self {
            samples: followed.iter().map(|tick| tick.ahead).collect(),
            corrections: followed.iter().map(|tick| tick.correction).collect(),
        }
    }

    /// Its samples.
    pub fn samples(&self) -> &[ReferenceSample<f32>] {
        &self.samples
    }
}

/// Signals of an axis, a sample a control period. A row is the tick in which the feedback works on that sample of the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenTrace {
    /// Reference, from where the axis stood, mm.
    pub reference_mm: Vec<f64>,
    /// True position, mm.
    pub position_mm: Vec<f64>,
    /// Position by the encoder, counts from where the axis stood; beyond an `i32` it wraps.
    pub counts: Vec<i32>,
    /// The converter's word.
    pub word: Vec<i16>,
    /// Output after all limits, V.
    pub output_v: Vec<f32>,
    /// Terms of the feedback, V: proportional, integral, derivative.
    pub feedback_v: [Vec<f32>; 3],
    /// Terms of the feedforward, V: friction and inertia.
    pub feedforward_v: [Vec<f32>; 2],
    /// True friction of the axis, V at the amplifier's input.
    pub friction_v: Vec<f32>,
    /// True where the output limit acts.
    pub limited: Vec<bool>,
}

impl GivenTrace {
    fn with_room(ticks: usize) -> Self {
        let room = || Vec::with_capacity(ticks);
        Self {
            reference_mm: Vec::with_capacity(ticks),
            position_mm: Vec::with_capacity(ticks),
            counts: Vec::with_capacity(ticks),
            word: Vec::with_capacity(ticks),
            output_v: room(),
            feedback_v: std::array::from_fn(|_| room()),
            feedforward_v: std::array::from_fn(|_| room()),
            friction_v: room(),
            limited: Vec::with_capacity(ticks),
        }
    }

    fn push<const N: usize>(
        &mut self,
        state: &AxisState<f32, N>,
        axis: &SimulatedAxis,
        (origin, resolution_mm): (Position, f64),
    ) {
        let seen = state.telemetry();
        self.reference_mm
            .push((seen.reference - origin).to_mm(resolution_mm));
        self.position_mm
            .push(axis.position_mm() - origin.to_mm(resolution_mm));
        let moved = seen.measured.position() - origin;
        self.counts.push((moved.0 >> POSITION_FRACTION_BITS) as i32);
        self.word.push(seen.code.0);
        self.output_v.push(seen.output_v());
        let feedback = &seen.feedback;
        let terms = [
            feedback.proportional,
            feedback.integral,
            feedback.derivative,
        ];
        for (signal, term) in self.feedback_v.iter_mut().zip(terms) {
            signal.push(term);
        }
        let terms = [seen.feedforward.friction(), seen.feedforward.inertia];
        for (signal, term) in self.feedforward_v.iter_mut().zip(terms) {
            signal.push(term);
        }
        self.friction_v.push(axis.friction_v() as f32);
        self.limited.push(seen.limited_by != LimitedBy::Nothing);
    }
}

/// The axes of a run.
#[derive(Clone, Debug)]
enum Plant {
    One(Box<SimulatedAxis>),
    Three(Box<SimulatedStage>),
}

/// A machine on a simulated stage that follows references in memory.
#[derive(Clone, Debug)]
pub struct GivenRun {
    machine: LawMachine<f32, FIRMWARE_ELEMENTS>,
    plant: Plant,
    references: Vec<GivenReference>,
    resolutions_mm: [f64; 3],
    /// Position of each axis at its start.
    origins: [Position; 3],
    /// Ticks by which the preview of each axis is shorter than the longest.
    waits: [usize; 3],
    /// The longest preview, ticks.
    preview_ticks: usize,
    rows: usize,
    tick: usize,
    /// The tick in which the axes started.
    since: Option<usize>,
    traces: Vec<GivenTrace>,
}

/// Longest time until the axes move, ticks.
const MOST_STARTING_TICKS: usize = 2000;
/// Ticks at which it asks to be enabled, and to start.
const REQUESTS: [(usize, Command); 2] = [(100, Command::Enable), (200, Command::Run)];

impl GivenRun {
    /// A run of one axis of a stage, which stands at rest; `seed` decides the encoder's noise. Operator, brake, homing and travel are left
    /// out.
    ///
    /// # Errors
    /// Settings that are refused.
    pub fn of_axis(
        settings: &StageSettings,
        truth: &StageParameters,
        axis: AxisName,
        reference: GivenReference,
        seed: u64,
    ) -> Result<Self, SettingsError> {
        let index = axis as usize;
        let own = &settings.axes[index];
        let settings = StageSettings {
            axes: [own.clone(), own.clone(), own.clone()],
            ..settings.clone()
        };
        let noise = seed.wrapping_mul(3).wrapping_add(index as u64);
        let truth = truth.axes[index].clone();
        let plant = SimulatedAxis::new(truth, settings.rate_hz, noise);
        let mut run = Self::new(settings, Plant::One(Box::new(plant)), vec![reference])?;
        run.machine = run.machine.with_x_alone();
        Ok(run)
    }

    /// A run of all axes, whose references are equally long. As [`of_axis`](Self::of_axis) otherwise.
    ///
    /// # Errors
    /// Settings that are refused.
    pub fn of_stage(
        settings: &StageSettings,
        truth: &StageParameters,
        references: [GivenReference; 3],
        seed: u64,
    ) -> Result<Self, SettingsError> {
        let plant = SimulatedStage::new(truth, settings.rate_hz, seed);
        Self::new(
            settings.clone(),
            Plant::Three(Box::new(plant)),
            references.into(),
        )
    }

    fn new(
        mut settings: StageSettings,
        plant: Plant,
        references: Vec<GivenReference>,
    ) -> Result<Self, SettingsError> {
        settings.operation = OperationSettings::default();
        settings.brake = BrakeSettings::default();
        for axis in &mut settings.axes {
            (axis.limits.travel_mm, axis.limits.unhomed_mm_s) = (None, None);
        }
        let previews = settings
            .axes
            .each_ref()
            .map(|axis| (axis.feedforward.preview_s * settings.rate_hz).round() as usize);
        let preview_ticks = previews.into_iter().fold(0, usize::max);
        let standing = Motion::Given(ReferenceSample::default());
        let plan = Plan::from_fn(|_| standing.clone());
        let rows = references.iter().map(|given| given.samples.len()).min();
        let rows = rows.unwrap_or(0);
        let traces = references.iter().map(|_| GivenTrace::with_room(rows));
        Ok(Self {
            machine: LawMachine::with_plan(settings.build()?, plan),
            plant,
            traces: traces.collect(),
            references,
            resolutions_mm: settings
                .axes
                .each_ref()
                .map(|axis| axis.encoder.resolution_mm),
            origins: [Position::ZERO; 3],
            waits: previews.map(|own| preview_ticks - own),
            preview_ticks,
            rows,
            tick: 0,
            since: None,
        })
    }

    /// Rows that it is to have.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Rows that it has.
    pub fn done(&self) -> usize {
        self.traces.first().map_or(0, |trace| trace.word.len())
    }

    /// Runs at most so many ticks; true once it is at its end.
    ///
    /// # Errors
    /// A fault, or axes that do not start because nobody has commissioned them.
    pub fn advance(&mut self, ticks: usize) -> Result<bool, RunError> {
        for _ in 0..ticks {
            if self.done() >= self.rows {
                break;
            }
            self.step()?;
        }
        Ok(self.done() >= self.rows)
    }

    /// The traces, an axis after the other.
    pub fn into_traces(self) -> Vec<GivenTrace> {
        self.traces
    }

    #[inline]
    fn step(&mut self) -> Result<(), RunError> {
        self.lead();
        let due = REQUESTS.iter().find(|(tick, _)| *tick == self.tick);
        let request = due.map(|(_, command)| *command);
        let counts = match &mut self.plant {
            Plant::One(axis) => [axis.read_counter(), 0, 0],
            Plant::Three(stage) => stage.read_counters(),
        };
        let outputs = self.machine.tick(&TickInput::of_counts(counts, request));
        if let SafetyState::Faulted(fault) = self.machine.state().safety() {
            return Err(RunError::Fault(fault));
        }
        self.record()?;
        self.drive(&outputs);
        self.tick += 1;
        Ok(())
    }

    /// Gives each axis its next sample; until it moves, the place where it stands.
    #[inline]
    fn lead(&mut self) {
        if self.since.is_none() && self.machine.starts_plan() {
            self.since = Some(self.tick);
        }
        for (index, reference) in self.references.iter().enumerate() {
            let first = self.since.map(|since| since + self.waits[index]);
            let place = first.and_then(|first| self.tick.checked_sub(first));
            let mut sample = match (place, reference.samples.last()) {
                (Some(place), Some(last)) => match reference.samples.get(place) {
                    Some(sample) => *sample,
                    None => ReferenceSample {
                        position: last.position,
                        ..ReferenceSample::default()
                    },
                },
                _ => ReferenceSample::default(),
            };
            if self.since.is_none_or(|since| since == self.tick) {
                self.origins[index] = self.machine.state().axes()[index].reference();
            }
            sample.position = sample.position + self.origins[index];
            let correction = place.and_then(|place| reference.corrections.get(place));
            self.machine
                .lead(AxisName::ALL[index], sample, correction.copied());
        }
    }

    #[inline]
    fn record(&mut self) -> Result<(), RunError> {
        let state = self.machine.state();
        let Some(since) = self.since else {
            return match self.machine.refusal() {
                Some(refusal) => Err(RunError::Refused(refusal)),
                None if self.tick > MOST_STARTING_TICKS => Err(RunError::NotStarted),
                None => Ok(()),
            };
        };
        if state.axes()[0].mode() != MotionMode::Plan {
            return Err(RunError::NotStarted);
        }
        if self.tick < since + self.preview_ticks {
            return Ok(());
        }
        for (index, trace) in self.traces.iter_mut().enumerate() {
            let axis = match &self.plant {
                Plant::One(axis) => axis,
                Plant::Three(stage) => &stage.axes()[index],
            };
            let state = &self.machine.state().axes()[index];
            let scale = (self.origins[index], self.resolutions_mm[index]);
            trace.push(state, axis, scale);
        }
        Ok(())
    }

    #[inline]
    fn drive(&mut self, outputs: &Outputs) {
        match &mut self.plant {
            Plant::One(axis) => axis.step(outputs.codes[0], outputs.enabled),
            Plant::Three(stage) => stage.step(outputs),
        }
    }
}
