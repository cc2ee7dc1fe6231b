//! A run of one axis: motions one after the other, on an axis that changes between them, while a tool may cut.

use quadrant_law::axes::AxisName;
use quadrant_law::axis::telemetry::AxisTelemetry;
use quadrant_law::cancelling::SpindleSpeed;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_law::reference::{HarmonicSettings, Motion, MotionSettings, RecordedTable};
use quadrant_law::safety::SafetyState;
use quadrant_law::units::DacCode;
use quadrant_settings::Job;
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};
use quadrant_sim::law_machine::{LawMachine, TickInput};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, SimulatedAxis};
use quadrant_sim::run::ELEMENTS;

/// The feedforward of a competitor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Friction {
    /// None: the feedback alone.
    Without,
    /// As the settings have it.
    Fixed,
    /// The same, learning.
    Learning,
}

impl Friction {
    pub(super) const ALL: [Self; 3] = [Self::Without, Self::Fixed, Self::Learning];

    /// The settings of an axis with it, under a PID.
    pub(super) fn of(self, axis: &AxisSettings) -> AxisSettings {
        let mut axis = axis.clone();
        axis.feedback.law = LawKind::Pid;
        axis.feedforward.kind = match self {
            Self::Without => FeedforwardKind::None,
            Self::Fixed | Self::Learning => FeedforwardKind::Combined,
        };
        axis.feedforward.learning = match self {
            Self::Learning => Some(LearningSettings::default()),
            Self::Without | Self::Fixed => None,
        };
        axis
    }
}

/// The motion of a phase.
#[derive(Clone, Debug)]
pub(super) enum PhaseMotion {
    Planned(MotionSettings),
    /// Along recorded positions.
    Recorded(RecordedTable<f32>),
}

/// A part of a run.
#[derive(Clone, Debug)]
pub(super) struct Phase {
    /// Its motion; a hold lasts for `rest_s`.
    pub(super) motion: PhaseMotion,
    pub(super) rest_s: f64,
    /// The axis as it then is, and what pushes it, from the beginning of the phase on.
    pub(super) truth: AxisParameters,
    pub(super) load: Load,
    /// Speed of the spindle that is set at its beginning, rpm.
    pub(super) spindle_rpm: Option<f64>,
}

/// Amplitude and velocity of the usual sine, mm and mm/s: those of the comparison.
pub(super) const SINE: (f64, f64) = (30.0, 10.0);
/// Its lead-in, s.
const LEAD_S: f64 = 0.5;
/// Time for a motion to begin, s.
const START_S: f64 = 0.1;

/// Length of a cycle of a sine, s.
pub(super) fn cycle_s((amplitude_mm, velocity_mm_s): (f64, f64)) -> f64 {
    std::f64::consts::TAU * amplitude_mm / velocity_mm_s
}

impl Phase {
    /// Cycles of a sine of an amplitude and a velocity, mm and mm/s.
    pub(super) fn sine(sine: (f64, f64), cycles: f64, truth: AxisParameters) -> Self {
        let harmonic = HarmonicSettings::with_velocity(sine.0, sine.1, cycles, LEAD_S);
        Self {
            motion: PhaseMotion::Planned(MotionSettings::Harmonic(harmonic)),
            rest_s: 0.0,
            truth,
            load: Load::None,
            spindle_rpm: None,
        }
    }

    pub(super) fn rest(seconds: f64, truth: AxisParameters) -> Self {
        Self {
            motion: PhaseMotion::Planned(MotionSettings::Hold),
            rest_s: seconds,
            truth,
            load: Load::None,
            spindle_rpm: None,
        }
    }

    pub(super) fn recorded(table: RecordedTable<f32>, truth: AxisParameters) -> Self {
        Self {
            motion: PhaseMotion::Recorded(table),
            ..Self::rest(0.0, truth)
        }
    }

    pub(super) fn loaded(self, load: Load) -> Self {
        Self { load, ..self }
    }
}

/// The trace of a phase: samples of every control period.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace {
    /// Reference less true position, um.
    pub(super) error_um: Vec<f64>,
    /// Scale of the friction feedforward.
    pub(super) scale: Vec<f32>,
}

impl Trace {
    /// Largest error of the last seconds of the motion, before its lead-out, um.
    pub(super) fn largest_um(&self, seconds: f64, rate_hz: f64) -> f64 {
        let last = self.last(seconds, rate_hz).iter();
        last.fold(0.0, |most: f64, error| most.max(error.abs()))
    }

    /// RMS error of them, um.
    pub(super) fn rms_um(&self, seconds: f64, rate_hz: f64) -> f64 {
        let last = self.last(seconds, rate_hz);
        (last.iter().map(|error| error * error).sum::<f64>() / last.len() as f64).sqrt()
    }

    /// The scale at the end.
    pub(super) fn learnt(&self) -> f64 {
        self.scale.last().map_or(1.0, |scale| f64::from(*scale))
    }

    fn last(&self, seconds: f64, rate_hz: f64) -> &[f64] {
        let samples = |seconds: f64| (seconds * rate_hz) as usize;
        let end = self.error_um.len().saturating_sub(samples(LEAD_S));
        &self.error_um[end.saturating_sub(samples(seconds))..end]
    }
}

/// Something beside the law that adds to its output.
pub(super) trait Addition {
    /// The voltage to add to the output of a tick, V.
    fn step(&mut self, seen: &AxisTelemetry<f32>) -> f64;
}

/// No addition.
pub(super) struct Nothing;

impl Addition for Nothing {
    fn step(&mut self, _: &AxisTelemetry<f32>) -> f64 {
        0.0
    }
}

/// Runs the phases on an axis with these settings; a trace of each.
///
/// # Errors
/// Settings that are refused, or a fault.
pub(super) fn run(
    stage: &StageSettings,
    axis: &AxisSettings,
    phases: &[Phase],
    addition: &mut dyn Addition,
    seed: u64,
) -> anyhow::Result<Vec<Trace>> {
    let stage = StageSettings {
        axes: [axis.clone(), axis.clone(), axis.clone()],
        ..stage.clone()
    };
    let (rate_hz, resolution_mm) = (stage.rate_hz, axis.encoder.resolution_mm);
    let plan = PlanSettings::default();
    let mut machine = LawMachine::<f32, ELEMENTS>::new(&Job {
        stage: stage.clone(),
        plan,
    })?
    .with_x_alone();
    let Some(first) = phases.first() else {
        return Ok(Vec::new());
    };
    let mut plant = SimulatedAxis::new(first.truth.clone(), rate_hz, seed);
    let code_per_v = DacCode::FULL_SCALE / axis.amplifier.full_scale_v;
    let mut requests = vec![Command::Enable];
    let mut traces = Vec::new();
    for phase in phases {
        plant.change(phase.truth.clone());
        let mut trace = Trace::default();
        let motion = match &phase.motion {
            PhaseMotion::Planned(motion) => {
                let motions = [*motion, MotionSettings::Hold, MotionSettings::Hold];
                PlanSettings { motions }.build(&stage)?[AxisName::X].clone()
            }
            PhaseMotion::Recorded(table) => Motion::Recorded(table.clone()),
        };
        let moves = motion != Motion::Hold;
        machine.set_motion(AxisName::X, motion);
        let starting = (START_S * rate_hz) as usize;
        let resting = (phase.rest_s * rate_hz) as usize;
        for tick in 0.. {
            if tick == starting
                && let Some(rpm) = phase.spindle_rpm
            {
                machine.set_spindle_speed(SpindleSpeed::from_rpm(rpm, 1.0 / rate_hz));
            }
            if tick == starting && moves {
                requests.push(Command::StartMove(AxisName::X));
            }
            let counts = [plant.read_counter(), 0, 0];
            let outputs = machine.tick(&TickInput::of_counts(counts, requests.pop()));
            let state = machine.state();
            if let SafetyState::Faulted(fault) = state.safety() {
                anyhow::bail!("fault {} in tick {}", fault.code.number(), fault.tick);
            }
            let seen = state.axes()[0].telemetry();
            let running = state.is_running();
            if running || !moves {
                let time_s = trace.error_um.len() as f64 / rate_hz;
                plant.set_load_v(phase.load.at_v(time_s));
                let error_mm = seen.reference.to_mm(resolution_mm) - plant.position_mm();
                trace.error_um.push(1e3 * error_mm);
                trace.scale.push(state.axes()[0].learning().scale());
            }
            let done = if moves {
                !running && !trace.error_um.is_empty()
            } else {
                tick >= resting
            };
            let added = (addition.step(seen) * code_per_v).round() as i32;
            let code = i32::from(outputs.codes[0].0) + added;
            let code = code.clamp(i32::from(-i16::MAX), i32::from(i16::MAX)) as i16;
            plant.step(DacCode(code), outputs.enabled);
            if done {
                break;
            }
        }
        plant.set_load_v(0.0);
        traces.push(trace);
    }
    Ok(traces)
}
