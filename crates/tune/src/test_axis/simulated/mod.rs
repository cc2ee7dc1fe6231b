//! One axis of the simulated stage as a test axis: its truth is on the other side of encoder and converter.

mod recorder;
mod watch;

use std::collections::VecDeque;

use self::recorder::{Period, Recorder};
use self::watch::Watch;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::MotionSettings;
use quadrant_law::safety::SafetyState;
use quadrant_law::supervisor::Event;
use quadrant_law::units::DacCode;
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};
use quadrant_sim::law_machine::{LawMachine, Operator, TickInput};
use quadrant_sim::plant::{AxisParameters, SimulatedAxis};
use quadrant_sim::settings_file::defaults_at;

use crate::record::Recording;
use crate::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, MachineError, TestAxis, Travel,
};

/// Room for GMS elements in the law.
const ELEMENTS: usize = quadrant_law::friction::gms::MAX_ELEMENTS;
/// Control periods within which the law has enabled the outputs, or does not.
const ENABLE_TICKS: usize = 1000;
/// Control periods between two reports of progress.
const PROGRESS_TICKS: usize = 20_000;
/// Control periods in which an axis without its outputs comes to rest.
const COASTING_TICKS: usize = 20_000;
/// Control periods for which it must stand.
const REST_TICKS: usize = 300;
/// Largest velocity that counts as rest, mm/s.
const AT_REST_MM_S: f64 = 0.01;
/// Control periods from the beginning of an experiment whose outputs are on to its motion.
const RUN_TICK: u32 = 100;
/// Time from one experiment to the next, with the outputs on: what a connected host takes for its requests, s.
const PAUSE_S: f64 = 0.1;
/// Names of the axes.
const NAMES: [&str; 3] = ["x", "y", "z"];

type Machine = LawMachine<f32, ELEMENTS>;

/// One axis of the simulated stage.
///
/// The injected voltage enters between the law's output and the converter, as it would through a summing amplifier,
/// and only while the law has the outputs enabled.
#[derive(Clone, Debug)]
pub struct SimulatedTestAxis {
    name: &'static str,
    plant: SimulatedAxis,
    full_scale_v: f64,
    resolution_mm: f64,
    travel: Travel,
    /// Largest distance of the table from the middle of the travel so far, mm.
    farthest_mm: f64,
    /// Loads of the next control periods with enabled outputs, V.
    loads_v: VecDeque<f64>,
    /// The recording of the last experiment, if that was stopped.
    interrupted: Option<Recording>,
    /// The axis under test is the first; the others stand still.
    stage: StageSettings,
    /// The law of the last experiment, if its outputs are still on.
    kept: Option<Box<Machine>>,
}

impl SimulatedTestAxis {
    /// Axis 0 to 2 with `truth`, under the default settings of that axis without feedforward and nonlinear gain; `seed`
    /// decides the noise.
    pub fn new(index: usize, truth: AxisParameters, seed: u64) -> Self {
        Self::under(&StageSettings::simulated(), index, truth, seed)
    }

    /// The same under other settings.
    pub fn under(settings: &StageSettings, index: usize, truth: AxisParameters, seed: u64) -> Self {
        let mut stage = settings.clone();
        let mut axis = stage.axes[index].clone();
        axis.feedback.law = LawKind::Pid;
        axis.feedforward.kind = FeedforwardKind::None;
        // A person watches what is measured.
        axis.commissioned = true;
        stage.axes[0] = axis;
        if stage.validate(ELEMENTS).is_err() {
            // The other axes do nothing here, and need not suit the rate.
            let [_, others @ ..] = &mut stage.axes;
            others.clone_from_slice(&defaults_at(stage.rate_hz).axes[1..]);
        }
        Self {
            name: NAMES[index],
            full_scale_v: truth.full_scale_v,
            resolution_mm: truth.resolution_mm,
            travel: Travel::BUILT_IN,
            farthest_mm: 0.0,
            loads_v: VecDeque::new(),
            interrupted: None,
            plant: SimulatedAxis::new(truth, stage.rate_hz, seed),
            stage,
            kept: None,
        }
    }

    /// The same axis with another travel either way, mm.
    #[must_use]
    pub fn with_travel_mm(self, travel_mm: f64) -> Self {
        self.with_travel(Travel::either_way(travel_mm))
    }

    /// The same axis with another travel from where it stands, which it has not moved from yet.
    #[must_use]
    pub fn with_travel(mut self, travel: Travel) -> Self {
        self.travel = travel;
        self.farthest_mm = travel.start_mm().abs();
        self
    }

    /// The axis itself, with its truth: for judging, not for identifying.
    pub fn plant(&self) -> &SimulatedAxis {
        &self.plant
    }

    /// Gives the axis other parameters while it stands, as warming does.
    pub fn change(&mut self, truth: AxisParameters) {
        self.plant.change(truth);
    }

    /// The largest distance from the middle of the travel at which the table was so far, mm: for judging.
    pub fn farthest_mm(&self) -> f64 {
        self.farthest_mm
    }

    /// Loads the table from outside, V at the amplifier input, one a control period from the first with enabled outputs that is not
    /// a pause between experiments.
    pub fn load(&mut self, loads_v: impl IntoIterator<Item = f64>) {
        self.loads_v = loads_v.into_iter().collect();
    }

    /// One control period of the plant.
    fn move_on(&mut self, code: DacCode, enabled: bool) {
        let load_v = self.loads_v.pop_front_if(|_| enabled);
        self.step_plant(code, enabled, load_v.unwrap_or(0.0));
    }

    fn step_plant(&mut self, code: DacCode, enabled: bool, load_v: f64) {
        self.plant.set_load_v(load_v);
        self.plant.step(code, enabled);
        let position_mm = self.plant.position_mm() + self.travel.start_mm();
        self.farthest_mm = self.farthest_mm.max(position_mm.abs());
    }

    /// Switches the outputs off: the next experiment gets a new law.
    fn forget(&mut self) {
        if self.kept.take().is_some() {
            self.move_on(DacCode::ZERO, false);
        }
    }

    /// Lets the axis come to rest without its outputs, as after a fault.
    fn coast(&mut self) {
        let mut rested = 0;
        for _ in 0..COASTING_TICKS {
            self.move_on(DacCode::ZERO, false);
            rested = if self.plant.velocity_mm_s().abs() < AT_REST_MM_S {
                rested + 1
            } else {
                0
            };
            if rested == REST_TICKS {
                break;
            }
        }
    }

    fn volts(&self, code: DacCode) -> f64 {
        f64::from(code.0) * self.full_scale_v / DacCode::FULL_SCALE
    }

    fn code(&self, volts: f64) -> DacCode {
        DacCode::from_volts(volts, self.full_scale_v)
    }

    /// Runs the experiment until it ends; to switch the outputs off is the caller's.
    fn drive(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let mut law = self.law(experiment)?;
        let mut watch = Watch::new(experiment, self.info());
        let mut recorder = Recorder::new(experiment.decimation, self.stage.rate_hz);
        let outcome = self.run(experiment, &mut law, &mut watch, &mut recorder, progress);
        if outcome.is_ok() {
            self.kept = law.into_machine();
        }
        self.interrupted = outcome
            .is_err()
            .then(|| recorder.latest(self.stage.rate_hz));
        outcome.map(|()| recorder.finish())
    }

    fn run(
        &mut self,
        experiment: &Experiment,
        law: &mut Law,
        watch: &mut Watch<'_>,
        recorder: &mut Recorder,
        progress: &mut dyn FnMut(f64),
    ) -> Result<(), ExperimentError> {
        let expected = experiment.injection_v.len().max(1);
        let mut waited = 0;
        let mut rested = false;
        loop {
            let raw = self.plant.read_counter();
            let moved_mm = f64::from(raw as i32) * self.resolution_mm;
            let position_mm = moved_mm + self.travel.start_mm();
            let Some(step) = law.step(raw, experiment)? else {
                if waited == ENABLE_TICKS && !rested {
                    // As a person would, who sees that the axis still moves.
                    rested = true;
                    waited = 0;
                    self.coast();
                    *law = self.law(experiment)?;
                    continue;
                }
                if waited == ENABLE_TICKS {
                    return Err(law.not_enabled(experiment));
                }
                waited += 1;
                self.move_on(DacCode::ZERO, false);
                continue;
            };
            if law.pauses() {
                recorder.note(Period {
                    reference_mm: position_mm + step.error_mm,
                    position_mm,
                    voltage_v: self.volts(step.code),
                    injection_v: 0.0,
                });
                self.step_plant(step.code, true, 0.0);
                continue;
            }
            let done = recorder.ticks();
            let injection_v = experiment.injection_v.get(done).copied();
            if injection_v.is_none() && step.motion_ended {
                progress(1.0);
                return Ok(());
            }
            let waits_for = if step.motion_ended {
                "the injection has not ended"
            } else {
                "the motion has not ended"
            };
            watch.check(done, position_mm, waits_for)?;
            if done.is_multiple_of(PROGRESS_TICKS) {
                progress((done as f64 / expected as f64).min(1.0));
            }
            let injection_v = injection_v.unwrap_or(0.0);
            let sum = i32::from(step.code.0) + i32::from(self.code(injection_v).0);
            let code = DacCode::saturating(sum);
            recorder.push(Period {
                reference_mm: position_mm + step.error_mm,
                position_mm,
                voltage_v: self.volts(code),
                injection_v,
            });
            self.move_on(code, true);
        }
    }

    /// The law's side of an experiment.
    fn law(&mut self, experiment: &Experiment) -> Result<Law, ExperimentError> {
        let kept = self.kept.take();
        let Drive::ClosedLoop(motion) = &experiment.drive else {
            return Ok(Law::OpenLoop);
        };
        let plan = PlanSettings {
            motions: [*motion, MotionSettings::Hold, MotionSettings::Hold],
        };
        let waits_for_motion = *motion != MotionSettings::Hold;
        let pause = (PAUSE_S * self.stage.rate_hz) as u32;
        let build = || {
            let plan = plan.build(&self.stage)?;
            let Some(mut machine) = kept else {
                let machine = LawMachine::with_plan(self.stage.build()?, plan).with_x_alone();
                return Ok((Box::new(machine), Operator::runs_the_plan(), 0));
            };
            machine.set_motion(AxisName::X, plan[AxisName::X].clone());
            let run = waits_for_motion.then_some((pause + RUN_TICK, Command::Run));
            Ok((machine, Operator::follows(run), pause))
        };
        let (machine, operator, begins) = build().map_err(|source| ExperimentError::Motion {
            experiment: experiment.name.clone(),
            source,
        })?;
        Ok(Law::ClosedLoop {
            machine,
            operator,
            tick: 0,
            begins,
            waits_for_motion,
        })
    }
}

/// The law's side of an experiment.
enum Law {
    OpenLoop,
    ClosedLoop {
        machine: Box<Machine>,
        operator: Operator,
        tick: u32,
        /// Tick up to which the axis rests from the experiment before.
        begins: u32,
        /// There is a motion, and it has not begun.
        waits_for_motion: bool,
    },
}

/// Output of the law in one control period with the outputs enabled.
struct Step {
    code: DacCode,
    /// Reference minus position, mm.
    error_mm: f64,
    motion_ended: bool,
}

impl Law {
    /// The law itself.
    fn into_machine(self) -> Option<Box<Machine>> {
        match self {
            Self::OpenLoop => None,
            Self::ClosedLoop { machine, .. } => Some(machine),
        }
    }

    /// True while the axis rests from the experiment before.
    fn pauses(&self) -> bool {
        matches!(self, Self::ClosedLoop { tick, begins, .. } if tick <= begins)
    }

    /// The law's reason to keep the outputs off.
    fn not_enabled(&self, experiment: &Experiment) -> ExperimentError {
        let (events, safety) = match self {
            Self::OpenLoop => (&[][..], None),
            Self::ClosedLoop { machine, .. } => (machine.events(), Some(machine.state().safety())),
        };
        let refusal = events.iter().find_map(|(_, event)| match event {
            Event::Refused(Command::Enable, refusal) => Some(refusal.as_str()),
            _ => None,
        });
        let refusal = refusal.or(match safety {
            Some(SafetyState::Faulted(fault)) => Some(fault.code.cause()),
            _ => None,
        });
        ExperimentError::Impossible {
            experiment: experiment.name.clone(),
            reason: format!(
                "the outputs were not enabled: {}",
                refusal.unwrap_or("no reason was given")
            ),
        }
    }

    /// One control period; nothing while the outputs are off.
    fn step(&mut self, raw: u32, experiment: &Experiment) -> Result<Option<Step>, ExperimentError> {
        let Self::ClosedLoop {
            machine,
            operator,
            tick,
            waits_for_motion,
            ..
        } = self
        else {
            return Ok(Some(Step {
                code: DacCode::ZERO,
                error_mm: 0.0,
                motion_ended: true,
            }));
        };
        let outputs = machine.tick(&TickInput::of_counts([raw, 0, 0], operator.request(*tick)));
        *tick += 1;
        let state = machine.state();
        if let SafetyState::Faulted(fault) = state.safety() {
            return Err(ExperimentError::Fault {
                experiment: experiment.name.clone(),
                fault,
            });
        }
        let running = state.is_running();
        *waits_for_motion &= !running;
        Ok(outputs.enabled.then(|| Step {
            code: outputs.codes[0],
            error_mm: f64::from(state.axes()[0].telemetry().error_mm()),
            motion_ended: !*waits_for_motion && !running,
        }))
    }
}

impl TestAxis for SimulatedTestAxis {
    fn info(&self) -> AxisInfo {
        AxisInfo {
            name: self.name,
            rate_hz: self.stage.rate_hz,
            resolution_mm: self.resolution_mm,
            full_scale_v: self.full_scale_v,
            travel_mm: self.travel.half_mm(),
            start_mm: self.travel.start_mm(),
            max_velocity_mm_s: self.settings().limits.max_velocity_mm_s,
            max_acceleration_mm_s2: self.settings().limits.max_acceleration_mm_s2,
        }
    }

    fn settings(&self) -> &AxisSettings {
        &self.stage.axes[0]
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        let mut stage = self.stage.clone();
        stage.axes[0] = settings.clone();
        stage.validate(ELEMENTS)?;
        if stage != self.stage {
            self.forget();
        }
        self.stage = stage;
        Ok(())
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.forget();
        Ok(())
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let outcome = self.drive(experiment, progress);
        if self.kept.is_none() {
            self.move_on(DacCode::ZERO, false);
        }
        if outcome.is_err() {
            self.coast();
        }
        outcome
    }

    fn interrupted(&self) -> Option<&Recording> {
        self.interrupted.as_ref()
    }
}
