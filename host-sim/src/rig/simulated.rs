//! One axis of the simulated stage as a rig: its truth is on the other side of encoder and converter.

use quadrant::link::lockstep::InputRecord;
use quadrant::reference::MotionSettings;
use quadrant::safety::SafetyState;
use quadrant::settings::{AxisSettings, PlanSettings, SettingsError, StageSettings};
use quadrant::units::DacCode;

use super::{Drive, Experiment, Recording, Rig, RigAxis, RigError};
use crate::machine::{Machine, Operator};
use crate::plant::{AxisTruth, SimulatedAxis};

/// Room for GMS elements in the law.
const ELEMENTS: usize = quadrant::friction::gms::MAX_ELEMENTS;
/// Travel either way, mm.
const TRAVEL_MM: f64 = 200.0;
/// Control periods between two reports of progress.
const PROGRESS_TICKS: usize = 20_000;
/// Control periods over which the velocity is watched.
const SPEED_TICKS: usize = 20;
/// What the axes are called.
const NAMES: [&str; 3] = ["x", "y", "z"];

/// One axis of the simulated stage.
///
/// The injected voltage enters between the law's output and the converter, as it would through a summing amplifier,
/// and only while the law has the outputs enabled.
#[derive(Clone, Debug)]
pub struct SimulatedRig {
    name: &'static str,
    plant: SimulatedAxis,
    full_scale_v: f64,
    resolution_mm: f64,
    stage: StageSettings,
}

impl SimulatedRig {
    /// Axis 0 to 2 with `truth`, under the default settings of that axis without feedforward and nonlinear gain; `seed`
    /// decides the noise.
    pub fn new(index: usize, truth: AxisTruth, seed: u64) -> Self {
        let mut stage = StageSettings::default();
        let mut axis = stage.axes[index].clone();
        axis.feedback.nonlinear = None;
        axis.feedforward.kind = quadrant::feedforward::FeedforwardKind::None;
        stage.axes[0] = axis;
        Self {
            name: NAMES[index],
            full_scale_v: truth.full_scale_v,
            resolution_mm: truth.resolution_mm,
            plant: SimulatedAxis::new(truth, stage.rate_hz, seed),
            stage,
        }
    }

    /// The axis itself, with its truth: for judging, not for identifying.
    pub fn plant(&self) -> &SimulatedAxis {
        &self.plant
    }

    /// The settings in force.
    pub fn settings(&self) -> &AxisSettings {
        &self.stage.axes[0]
    }

    fn volts(&self, code: DacCode) -> f64 {
        f64::from(code.0) * self.full_scale_v / DacCode::FULL_SCALE
    }

    fn code(&self, volts: f64) -> DacCode {
        DacCode::saturating((volts / self.full_scale_v * DacCode::FULL_SCALE).round() as i32)
    }
}

/// The law's side of an experiment.
enum Law {
    OpenLoop,
    ClosedLoop {
        machine: Box<Machine<f32, ELEMENTS>>,
        operator: Operator,
    },
}

impl Rig for SimulatedRig {
    fn axis(&self) -> RigAxis {
        RigAxis {
            name: self.name,
            rate_hz: self.stage.rate_hz,
            resolution_mm: self.resolution_mm,
            full_scale_v: self.full_scale_v,
            travel_mm: TRAVEL_MM,
            max_velocity_mm_s: self.settings().limits.max_velocity_mm_s,
        }
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), SettingsError> {
        let mut stage = self.stage.clone();
        stage.axes[0] = settings.clone();
        stage.validate(ELEMENTS)?;
        self.stage = stage;
        Ok(())
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, RigError> {
        let mut law = match &experiment.drive {
            Drive::OpenLoop => Law::OpenLoop,
            Drive::ClosedLoop(motion) => {
                let plan = PlanSettings {
                    motions: [*motion, MotionSettings::Hold, MotionSettings::Hold],
                };
                let built = self
                    .stage
                    .build()
                    .and_then(|stage| Ok((stage, plan.build(&self.stage)?)));
                let (stage, plan) = built.map_err(|source| RigError::Motion {
                    experiment: experiment.name.clone(),
                    source,
                })?;
                Law::ClosedLoop {
                    machine: Box::new(Machine::with_plan(stage, plan)),
                    operator: Operator::runs_the_plan(),
                }
            }
        };
        let moves = !matches!(
            experiment.drive,
            Drive::OpenLoop | Drive::ClosedLoop(MotionSettings::Hold)
        );
        let rate_hz = self.stage.rate_hz;
        let limits = self.axis();
        let mut recorder = Recorder::new(experiment, rate_hz);
        let mut moved = false;
        let mut watched_mm = None;
        let most_ticks = (experiment.time_limit_s * rate_hz) as usize;
        let expected = experiment.injection_v.len().max(1);
        for tick in 0.. {
            let raw = self.plant.read_counter();
            let position_mm = f64::from(raw as i32) * self.resolution_mm;
            let (code, enabled, reference_mm, running) = match &mut law {
                Law::OpenLoop => (DacCode::ZERO, true, position_mm, false),
                Law::ClosedLoop { machine, operator } => {
                    let outputs = machine.tick(&InputRecord {
                        counts: [raw, 0, 0],
                        request: operator.request(tick as u32),
                    });
                    let state = machine.state();
                    if let SafetyState::Faulted(fault) = state.safety() {
                        self.plant.step(DacCode::ZERO, false);
                        let experiment = experiment.name.clone();
                        return Err(RigError::Fault { experiment, fault });
                    }
                    // The law counts positions from where it was switched on.
                    let telemetry = state.axes()[0].telemetry();
                    let error_mm = f64::from(telemetry.error_mm());
                    let running = state.is_running();
                    (
                        outputs.codes[0],
                        outputs.enabled,
                        position_mm + error_mm,
                        running,
                    )
                }
            };
            if !enabled {
                self.plant.step(DacCode::ZERO, false);
                continue;
            }
            moved |= running;
            let done = recorder.ticks;
            let injected_v = experiment.injection_v.get(done).copied();
            let motion_ended = !moves || (moved && !running);
            if injected_v.is_none() && motion_ended {
                self.plant.step(DacCode::ZERO, false);
                progress(1.0);
                return Ok(recorder.finish());
            }
            let time_s = done as f64 / rate_hz;
            if position_mm.abs() > limits.travel_mm {
                self.plant.step(DacCode::ZERO, false);
                return Err(RigError::Travel {
                    experiment: experiment.name.clone(),
                    travel_mm: limits.travel_mm,
                    time_s,
                });
            }
            if done.is_multiple_of(SPEED_TICKS) {
                let last_mm = watched_mm.replace(position_mm).unwrap_or(position_mm);
                let velocity_mm_s = (position_mm - last_mm) * rate_hz / SPEED_TICKS as f64;
                if velocity_mm_s.abs() > limits.max_velocity_mm_s {
                    self.plant.step(DacCode::ZERO, false);
                    return Err(RigError::Overspeed {
                        experiment: experiment.name.clone(),
                        max_velocity_mm_s: limits.max_velocity_mm_s,
                        time_s,
                    });
                }
            }
            if done >= most_ticks {
                self.plant.step(DacCode::ZERO, false);
                return Err(RigError::TimedOut {
                    experiment: experiment.name.clone(),
                    time_limit_s: experiment.time_limit_s,
                    reason: if motion_ended {
                        "the injection has not ended"
                    } else {
                        "the motion has not ended"
                    },
                });
            }
            if done.is_multiple_of(PROGRESS_TICKS) {
                progress((done as f64 / expected as f64).min(1.0));
            }
            let summed = i32::from(code.0) + i32::from(self.code(injected_v.unwrap_or(0.0)).0);
            let code = DacCode::saturating(summed);
            recorder.push(
                reference_mm,
                position_mm,
                self.volts(code),
                injected_v.unwrap_or(0.0),
            );
            self.plant.step(code, true);
        }
        unreachable!("the loop has no end but its returns")
    }
}

/// Gathers control periods into samples.
struct Recorder {
    recording: Recording,
    decimation: usize,
    ticks: usize,
    voltage_v: f64,
    injection_v: f64,
}

impl Recorder {
    fn new(experiment: &Experiment, rate_hz: f64) -> Self {
        let decimation = experiment.decimation.max(1);
        Self {
            recording: Recording {
                sample_time_s: decimation as f64 / rate_hz,
                ..Recording::default()
            },
            decimation,
            ticks: 0,
            voltage_v: 0.0,
            injection_v: 0.0,
        }
    }

    fn push(&mut self, reference_mm: f64, position_mm: f64, voltage_v: f64, injection_v: f64) {
        let Self {
            recording,
            decimation,
            ..
        } = self;
        if self.ticks.is_multiple_of(*decimation) {
            recording.reference_mm.push(reference_mm);
            recording.position_mm.push(position_mm);
        }
        self.voltage_v += voltage_v;
        self.injection_v += injection_v;
        self.ticks += 1;
        if self.ticks.is_multiple_of(*decimation) {
            let count = *decimation as f64;
            recording.voltage_v.push(self.voltage_v / count);
            recording.injection_v.push(self.injection_v / count);
            self.voltage_v = 0.0;
            self.injection_v = 0.0;
        }
    }

    /// The recording without an incomplete last sample.
    fn finish(mut self) -> Recording {
        let complete = self.recording.voltage_v.len();
        self.recording.reference_mm.truncate(complete);
        self.recording.position_mm.truncate(complete);
        self.recording
    }
}
