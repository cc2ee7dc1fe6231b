//! One configuration on sines of three velocities, of 30 mm unless another amplitude is asked for.

use quadrant::lockstep::Job;
use quadrant::reference::{HarmonicSettings, MotionSettings};
use quadrant::scalar::Scalar;
use quadrant::settings::PlanSettings;

use crate::experiment::configuration::{Configuration, ELEMENTS};
use crate::experiment::metrics::{Score, score};
use crate::experiment::run::{AxisTrace, RunError, run};
use crate::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use crate::machine::{LawMachine, Operator};
use crate::plant::{SimulatedStage, StageParameters};

/// Amplitude of the sine, mm.
pub const AMPLITUDE_MM: f64 = 30.0;
/// Its largest velocities, mm/s.
pub const VELOCITIES_MM_S: [f64; 3] = [5.0, 10.0, 15.0];
/// Cycles at full speed, of which the last whole ones count.
pub const CYCLES: f64 = 2.25;
pub const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// Result of one configuration at one velocity.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub configuration: Configuration,
    /// The law's knowledge of the plant.
    pub knowledge: ModelKnowledge,
    /// Amplitude of the sine, mm.
    pub amplitude_mm: f64,
    /// Largest velocity of the sine, mm/s.
    pub velocity_mm_s: f64,
    pub score: Score,
    /// The last scored cycle.
    pub last_cycle: AxisTrace,
}

/// The x axis three times, one for each velocity, and the sines they run.
fn job(configuration: Configuration, setup: &RunConfiguration, amplitude_mm: f64) -> Job {
    let mut stage = setup.stage_of(configuration);
    let x = stage.axes[0].clone();
    stage.axes = [x.clone(), x.clone(), x];
    Job {
        stage,
        plan: PlanSettings {
            motions: VELOCITIES_MM_S.map(|velocity| {
                MotionSettings::Harmonic(HarmonicSettings::with_velocity(
                    amplitude_mm,
                    velocity,
                    CYCLES,
                    LEAD_S,
                ))
            }),
        },
    }
}

/// Time of one cycle of a sine with a largest velocity, s.
pub fn cycle_s(amplitude_mm: f64, velocity_mm_s: f64) -> f64 {
    std::f64::consts::TAU * amplitude_mm / velocity_mm_s
}

/// All that a run of the comparison needs but the machine itself.
pub struct Bench {
    /// Settings and plan of the machine.
    pub job: Job,
    /// The stage it runs on.
    pub plant: SimulatedStage,
    pub operator: Operator,
    /// Ticks after which the slowest sine has ended.
    pub most_ticks: usize,
}

impl Bench {
    /// The x axis three times, on its job.
    pub fn new(
        configuration: Configuration,
        setup: &RunConfiguration,
        amplitude_mm: f64,
        seed: u64,
    ) -> Self {
        let job = job(configuration, setup, amplitude_mm);
        let [x, ..] = &setup.truth.axes;
        let truth = StageParameters {
            axes: [x.clone(), x.clone(), x.clone()],
        };
        let rate_hz = job.stage.rate_hz;
        let longest_s = 2.0 + 2.0 * LEAD_S + CYCLES * cycle_s(amplitude_mm, VELOCITIES_MM_S[0]);
        Self {
            plant: SimulatedStage::new(&truth, rate_hz, seed),
            operator: Operator::runs_the_plan(),
            most_ticks: (longest_s * rate_hz) as usize,
            job,
        }
    }
}

/// Runs one configuration at all velocities, side by side, on a sine of 30 mm in the arithmetic of `S`.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_configuration<S: Scalar>(
    configuration: Configuration,
    setup: &RunConfiguration,
    seed: u64,
) -> Result<[Outcome; 3], RunError> {
    run_at_amplitude::<S>(configuration, setup, AMPLITUDE_MM, seed)
}

/// The same on a sine of any amplitude, mm, above zero and within the axis' travel.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_at_amplitude<S: Scalar>(
    configuration: Configuration,
    setup: &RunConfiguration,
    amplitude_mm: f64,
    seed: u64,
) -> Result<[Outcome; 3], RunError> {
    let bench = Bench::new(configuration, setup, amplitude_mm, seed);
    run_bench::<S>(bench, configuration, setup, amplitude_mm)
}

/// The same on a bench that is there: its plant may have been changed.
pub fn run_bench<S: Scalar>(
    mut bench: Bench,
    configuration: Configuration,
    setup: &RunConfiguration,
    amplitude_mm: f64,
) -> Result<[Outcome; 3], RunError> {
    let rate_hz = bench.job.stage.rate_hz;
    let resolution_mm = bench
        .job
        .stage
        .axes
        .each_ref()
        .map(|axis| axis.encoder.resolution_mm);
    let mut machine = LawMachine::<S, ELEMENTS>::new(&bench.job)?;
    let traces = run(
        &mut machine,
        &mut bench.plant,
        resolution_mm,
        bench.most_ticks,
    )?;
    let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
    let mut velocities = VELOCITIES_MM_S.into_iter();
    Ok(traces.map(|trace| {
        let velocity_mm_s = velocities.next().unwrap_or_default();
        let period_s = cycle_s(amplitude_mm, velocity_mm_s);
        let cycle = samples(period_s);
        let end = samples(LEAD_S) + samples(CYCLES * period_s);
        let scored = trace.slice(end - SCORED_CYCLES * cycle..end);
        Outcome {
            configuration,
            knowledge: setup.knowledge,
            amplitude_mm,
            velocity_mm_s,
            score: score(&scored.reference_mm, &scored.error_mm, cycle),
            last_cycle: scored.slice((SCORED_CYCLES - 1) * cycle..SCORED_CYCLES * cycle),
        }
    }))
}
