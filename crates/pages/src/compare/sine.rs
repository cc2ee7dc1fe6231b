//! One configuration on sines of up to three velocities: x on 30 mm at 5, 10 and 15 mm/s unless others are asked for.

use quadrant_law::axes::AxisName;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::scalar::Scalar;
use quadrant_settings::Job;
use quadrant_settings::PlanSettings;
use quadrant_sim::law_machine::{LawMachine, Operator};
use quadrant_sim::metrics::{Score, score};
use quadrant_sim::plant::{SimulatedStage, StageParameters};
use quadrant_sim::run::{AxisTrace, ELEMENTS, RunError, run};

use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::{ModelKnowledge, RunConfiguration};

/// Amplitude of the sine, mm.
pub const AMPLITUDE_MM: f64 = 30.0;
/// Its largest velocities, mm/s.
pub const VELOCITIES_MM_S: [f64; 3] = [5.0, 10.0, 15.0];
/// Cycles at full speed.
pub const CYCLES: f64 = 2.25;
/// Whole cycles at the end that are scored.
pub const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// Sines of an axis, which run side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Sines {
    pub axis: AxisName,
    /// Their amplitude, mm; above zero and within the axis' travel.
    pub amplitude_mm: f64,
    /// Their largest velocities, mm/s; one to three, above zero.
    pub velocities_mm_s: Vec<f64>,
}

impl Default for Sines {
    /// Those of most of the thesis' chapter.
    fn default() -> Self {
        Self::of_amplitude(AMPLITUDE_MM)
    }
}

impl Sines {
    /// The x axis at the usual velocities.
    pub fn of_amplitude(amplitude_mm: f64) -> Self {
        Self {
            axis: AxisName::X,
            amplitude_mm,
            velocities_mm_s: VELOCITIES_MM_S.to_vec(),
        }
    }

    /// Time of the longest cycle, s.
    pub fn longest_cycle_s(&self) -> f64 {
        let cycles = self.velocities_mm_s.iter();
        let cycles = cycles.map(|&velocity| cycle_s(self.amplitude_mm, velocity));
        cycles.fold(0.0, f64::max)
    }

    /// A velocity for each axis of the machine: the last one is repeated.
    fn side_by_side(&self) -> [f64; 3] {
        let last = self.velocities_mm_s.last().copied().unwrap_or_default();
        std::array::from_fn(|index| self.velocities_mm_s.get(index).copied().unwrap_or(last))
    }
}

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

/// The axis three times, one for each velocity, and the sines they run.
fn job(configuration: Configuration, setup: &RunConfiguration, sines: &Sines) -> Job {
    let mut stage = setup.stage_of(configuration);
    let axis = stage.axes[sines.axis as usize].clone();
    stage.axes = [axis.clone(), axis.clone(), axis];
    Job {
        stage,
        plan: PlanSettings {
            motions: sines.side_by_side().map(|velocity| {
                MotionSettings::Harmonic(HarmonicSettings::with_velocity(
                    sines.amplitude_mm,
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
    /// The axis three times, on its job.
    pub fn new(
        configuration: Configuration,
        setup: &RunConfiguration,
        sines: &Sines,
        seed: u64,
    ) -> Self {
        let job = job(configuration, setup, sines);
        let axis = &setup.truth.axes[sines.axis as usize];
        let truth = StageParameters {
            axes: [axis.clone(), axis.clone(), axis.clone()],
        };
        let rate_hz = job.stage.rate_hz;
        let longest_s = 2.0 + 2.0 * LEAD_S + CYCLES * sines.longest_cycle_s();
        Self {
            plant: SimulatedStage::new(&truth, rate_hz, seed),
            operator: Operator::runs_the_plan(),
            most_ticks: (longest_s * rate_hz) as usize,
            job,
        }
    }
}

/// Runs one configuration on the usual sines in the arithmetic of `S`.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_configuration<S: Scalar>(
    configuration: Configuration,
    setup: &RunConfiguration,
    seed: u64,
) -> Result<[Outcome; 3], RunError> {
    run_sines::<S>(configuration, setup, &Sines::default(), seed)
}

/// The same on any sines, side by side: of fewer than three velocities the last outcomes are alike.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_sines<S: Scalar>(
    configuration: Configuration,
    setup: &RunConfiguration,
    sines: &Sines,
    seed: u64,
) -> Result<[Outcome; 3], RunError> {
    let bench = Bench::new(configuration, setup, sines, seed);
    run_bench::<S>(bench, configuration, setup, sines)
}

/// The same on a bench that is there: its plant may have been changed.
pub fn run_bench<S: Scalar>(
    mut bench: Bench,
    configuration: Configuration,
    setup: &RunConfiguration,
    sines: &Sines,
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
    let amplitude_mm = sines.amplitude_mm;
    let mut velocities = sines.side_by_side().into_iter();
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
