//! One run: a machine on a simulated stage, and the traces of its axes.

use quadrant_law::admission::Refusal;
use quadrant_law::axis::telemetry::AxisTelemetry;
use quadrant_law::safety::SafetyState;
use quadrant_law::scalar::Scalar;

use crate::law_machine::{LawMachine, Operator, TickInput};
use crate::plant::SimulatedStage;

/// Room for GMS elements: the exact model has the plant's ten.
pub const ELEMENTS: usize = 10;

/// Trace of one axis, a sample a control period from the start of the motion.
#[derive(Clone, Debug, Default)]
pub struct AxisTrace {
    /// Reference, mm.
    pub reference_mm: Vec<f64>,
    /// Reference minus true position, mm.
    pub error_mm: Vec<f64>,
    /// Output of the control law, V.
    pub output_v: Vec<f64>,
}

impl AxisTrace {
    /// Adds a tick: what the law says of it, and where the axis truly was, mm. `resolution_mm` is the encoder's.
    pub fn push<S: Scalar>(&mut self, seen: &AxisTelemetry<S>, resolution_mm: f64, place_mm: f64) {
        let reference = seen.reference.to_mm(resolution_mm);
        self.reference_mm.push(reference);
        self.error_mm.push(reference - place_mm);
        self.output_v.push(f64::from(seen.output_v()));
    }

    /// The samples of a range, of every signal.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let part = |signal: &[f64]| signal[range.clone()].to_vec();
        Self {
            reference_mm: part(&self.reference_mm),
            error_mm: part(&self.error_mm),
            output_v: part(&self.output_v),
        }
    }
}

/// Reasons for which a run gives no traces.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RunError {
    /// The settings are refused.
    #[error("settings refused: {0}")]
    Settings(#[from] quadrant_settings::SettingsError),
    /// The stage switched off.
    #[error("fault {number} on {axis} at tick {tick}: {cause}; {remedy}", number = .0.code.number(),
        axis = .0.axis.map_or("the stage", quadrant_law::axes::AxisName::as_str), tick = .0.tick,
        cause = .0.code.cause(), remedy = .0.code.remedy())]
    Fault(quadrant_law::safety::Fault),
    /// The law refused to enable the outputs, or to start.
    #[error("the axes did not start: {0}")]
    Refused(Refusal),
    /// The axes did not start.
    #[error("the axes did not start")]
    NotStarted,
    /// The motion did not end.
    #[error("the motion has not ended after {0} ticks")]
    Endless(usize),
}

/// Runs the machine's plan from its start to its end. `most_ticks` bounds a plan without an end;
/// `resolution_mm` is the axes' encoder resolution.
///
/// # Errors
/// A fault, or a motion that does not end in time.
pub fn run<S: Scalar, const N: usize>(
    machine: &mut LawMachine<S, N>,
    plant: &mut SimulatedStage,
    resolution_mm: [f64; 3],
    most_ticks: usize,
) -> Result<[AxisTrace; 3], RunError> {
    let mut operator = Operator::runs_the_plan();
    let mut traces: [AxisTrace; 3] = Default::default();
    let mut started = false;
    for tick in 0..most_ticks {
        let outputs = machine.tick(&TickInput::of_counts(
            plant.read_counters(),
            operator.request(tick as u32),
        ));
        if !started && let Some(refusal) = machine.refusal() {
            return Err(RunError::Refused(refusal));
        }
        let state = machine.state();
        if let SafetyState::Faulted(fault) = state.safety() {
            return Err(RunError::Fault(fault));
        }
        if state.is_running() {
            started = true;
        } else if started {
            return Ok(traces);
        }
        if started {
            for (index, trace) in traces.iter_mut().enumerate() {
                let seen = state.axes()[index].telemetry();
                let place_mm = plant.axes()[index].position_mm();
                trace.push(seen, resolution_mm[index], place_mm);
            }
        }
        plant.step(&outputs);
    }
    Err(RunError::Endless(most_ticks))
}
