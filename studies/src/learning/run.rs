//! A run of one axis: motions one after the other, on an axis that changes between them, while a tool may cut.

use quadrant_law::axes::AxisName;
use quadrant_law::cancelling::SpindleSpeed;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::SafetyState;
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};
use quadrant_sim::law_machine::TickInput;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT, SimulatedAxis, StageParameters};

use crate::competitor::Feedforward;
use crate::x_alone::law_of;

/// The x axis of the simulated stage.
pub(super) fn nominal() -> AxisParameters {
    let [x, ..] = StageParameters::real().axes;
    x
}

/// The settings of an axis with a feedforward, under a PID.
pub(super) fn under_pid(axis: &AxisSettings, feedforward: Feedforward) -> AxisSettings {
    let mut axis = axis.clone();
    axis.feedback.law = LawKind::Pid;
    feedforward.apply(&mut axis);
    axis
}

/// A cut all along, whose force across the feed acts on the axis.
pub(super) fn slot(cut: Milling) -> Load {
    Load::Milling {
        cut,
        component: Component::Normal,
        engaged_s: (0.0, 1e3),
        newtons_per_volt: NEWTONS_PER_VOLT,
    }
}

/// A part of a run.
#[derive(Clone, Debug)]
pub(super) struct Phase {
    pub(super) motion: MotionSettings,
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
            motion: MotionSettings::Harmonic(harmonic),
            truth,
            load: Load::None,
            spindle_rpm: None,
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

/// Runs the phases on an axis with these settings; a trace of each.
///
/// # Errors
/// Settings that are refused, or a fault.
pub(super) fn run(
    stage: &StageSettings,
    axis: &AxisSettings,
    phases: &[Phase],
    seed: u64,
) -> anyhow::Result<Vec<Trace>> {
    let (rate_hz, resolution_mm) = (stage.rate_hz, axis.encoder.resolution_mm);
    let mut machine = law_of(axis, stage, MotionSettings::Hold)?;
    let Some(first) = phases.first() else {
        return Ok(Vec::new());
    };
    let mut plant = SimulatedAxis::new(first.truth.clone(), rate_hz, seed);
    let mut requests = vec![Command::Enable];
    let mut traces = Vec::new();
    for phase in phases {
        plant.change(phase.truth.clone());
        let mut trace = Trace::default();
        let motions = [phase.motion, MotionSettings::Hold, MotionSettings::Hold];
        let motion = PlanSettings { motions }.build(stage)?[AxisName::X].clone();
        machine.set_motion(AxisName::X, motion);
        let starting = (START_S * rate_hz) as usize;
        for tick in 0.. {
            if tick == starting
                && let Some(rpm) = phase.spindle_rpm
            {
                machine.set_spindle_speed(SpindleSpeed::from_rpm(rpm, 1.0 / rate_hz));
            }
            if tick == starting {
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
            if running {
                let time_s = trace.error_um.len() as f64 / rate_hz;
                plant.set_load_v(phase.load.at_v(time_s));
                let error_mm = seen.reference.to_mm(resolution_mm) - plant.position_mm();
                trace.error_um.push(1e3 * error_mm);
                trace.scale.push(state.axes()[0].learning().scale());
            }
            let done = !running && !trace.error_um.is_empty();
            plant.step(outputs.codes[0], outputs.enabled);
            if done {
                break;
            }
        }
        plant.set_load_v(0.0);
        traces.push(trace);
    }
    Ok(traces)
}
