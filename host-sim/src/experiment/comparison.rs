//! The thesis' comparison: {PID, N-PID} x {no, static, GMS, combined feedforward} on a sine, of 30 mm unless another
//! amplitude is asked for, at three velocities.

use indicatif::ProgressBar;
use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::lockstep::Job;
use quadrant::reference::{HarmonicSettings, MotionSettings};
use quadrant::scalar::Scalar;
use quadrant::settings::{PlanSettings, StageSettings};
use rayon::prelude::*;

use super::compensator::{Knowledge, Setup};
use super::metrics::{Score, change_percent, score};
use super::run::{AxisTrace, RunError, run};
use super::thesis::Metric;
use crate::machine::{Machine, Operator};
use crate::plant::{SimulatedStage, StageTruth};

/// Amplitude of the sine, mm.
pub const AMPLITUDE_MM: f64 = 30.0;
/// Its largest velocities, mm/s.
pub const VELOCITIES_MM_S: [f64; 3] = [5.0, 10.0, 15.0];
/// Cycles at full speed, of which the last whole ones count.
pub const CYCLES: f64 = 2.25;
/// Cycles that count.
pub const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;
/// Room for GMS elements: the matched compensator has the plant's ten.
pub const ELEMENTS: usize = 10;

/// Feedback and feedforward together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// Feedback.
    pub controller: LawKind,
    /// Feedforward.
    pub feedforward: FeedforwardKind,
}

impl Configuration {
    /// PID alone.
    pub const PID: Self = Self {
        controller: LawKind::Pid,
        feedforward: FeedforwardKind::None,
    };
    /// Everything: N-PID with static and GMS feedforward.
    pub const BEST: Self = Self {
        controller: LawKind::NPid,
        feedforward: FeedforwardKind::Combined,
    };
    /// What most studies compare.
    pub const EXTREMES: [Self; 2] = [Self::PID, Self::BEST];

    /// All eight, in the order of the thesis' tables.
    pub fn all() -> Vec<Self> {
        [LawKind::Pid, LawKind::NPid]
            .into_iter()
            .flat_map(|controller| {
                FeedforwardKind::THESIS.map(|feedforward| Self {
                    controller,
                    feedforward,
                })
            })
            .collect()
    }

    /// Its name in tables.
    pub fn name(self) -> String {
        let controller = self.controller.name();
        match self.feedforward {
            FeedforwardKind::None => controller.to_owned(),
            FeedforwardKind::Static => format!("{controller} + static"),
            FeedforwardKind::Gms => format!("{controller} + GMS"),
            FeedforwardKind::Combined => format!("{controller} + static + GMS"),
            FeedforwardKind::Dahl => format!("{controller} + Dahl"),
            FeedforwardKind::Lugre => format!("{controller} + LuGre"),
            FeedforwardKind::SmoothedGms => format!("{controller} + S-GMS"),
        }
    }

    /// Sets the stage up for it.
    pub fn apply(self, stage: &mut StageSettings) {
        for axis in &mut stage.axes {
            axis.feedback.law = self.controller;
            axis.feedforward.kind = self.feedforward;
        }
    }
}

/// What one configuration did at one velocity.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Who ran.
    pub configuration: Configuration,
    /// What the compensator knew.
    pub knowledge: Knowledge,
    /// Amplitude of the sine, mm.
    pub amplitude_mm: f64,
    /// Largest velocity of the sine, mm/s.
    pub velocity_mm_s: f64,
    /// What it scored.
    pub score: Score,
    /// The last scored cycle.
    pub last_cycle: AxisTrace,
}

/// The x axis three times, one for each velocity, and the sines they run.
fn job(configuration: Configuration, setup: &Setup, amplitude_mm: f64) -> Job {
    let mut stage = setup.stage.clone();
    let x = stage.axes[0].clone();
    stage.axes = [x.clone(), x.clone(), x];
    configuration.apply(&mut stage);
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
pub(super) struct Bench {
    /// What the machine is to run.
    pub(super) job: Job,
    /// The stage it runs on.
    pub(super) plant: SimulatedStage,
    /// Who starts it.
    pub(super) operator: Operator,
    /// Ticks after which the slowest sine has ended.
    pub(super) most_ticks: usize,
}

impl Bench {
    /// The x axis three times, on its job.
    pub(super) fn new(
        configuration: Configuration,
        setup: &Setup,
        amplitude_mm: f64,
        seed: u64,
    ) -> Self {
        let job = job(configuration, setup, amplitude_mm);
        let [x, ..] = &setup.truth.axes;
        let truth = StageTruth {
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
    setup: &Setup,
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
    setup: &Setup,
    amplitude_mm: f64,
    seed: u64,
) -> Result<[Outcome; 3], RunError> {
    let bench = Bench::new(configuration, setup, amplitude_mm, seed);
    run_bench::<S>(bench, configuration, setup, amplitude_mm)
}

/// The same on a bench that is there: its plant may have been changed.
pub(super) fn run_bench<S: Scalar>(
    mut bench: Bench,
    configuration: Configuration,
    setup: &Setup,
    amplitude_mm: f64,
) -> Result<[Outcome; 3], RunError> {
    let rate_hz = bench.job.stage.rate_hz;
    let resolution_mm = bench
        .job
        .stage
        .axes
        .each_ref()
        .map(|axis| axis.encoder.resolution_mm);
    let mut machine = Machine::<S, ELEMENTS>::new(&bench.job)?;
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

/// Number of runs in [`run_all`] of a setup.
pub const RUNS: u64 = 8;

/// The whole comparison, in parallel; the same seed gives the same outcomes. `progress` advances by one a run.
///
/// # Errors
/// The first refused setting or fault.
pub fn run_all<S: Scalar>(
    setups: &[Setup],
    seed: u64,
    progress: &ProgressBar,
) -> Result<Vec<Outcome>, RunError> {
    let runs: Vec<_> = setups
        .iter()
        .flat_map(|setup| Configuration::all().into_iter().map(move |c| (c, setup)))
        .collect();
    let outcomes: Result<Vec<_>, _> = runs
        .into_par_iter()
        .map(|(configuration, setup)| {
            let outcomes = run_configuration::<S>(configuration, setup, seed);
            progress.inc(1);
            outcomes
        })
        .collect();
    Ok(outcomes?.into_iter().flatten().collect())
}

/// The score of a configuration at a velocity.
pub fn find(
    outcomes: &[Outcome],
    configuration: Configuration,
    knowledge: Knowledge,
    velocity_mm_s: f64,
) -> Option<&Outcome> {
    outcomes.iter().find(|outcome| {
        outcome.configuration == configuration
            && outcome.knowledge == knowledge
            && outcome.velocity_mm_s == velocity_mm_s
    })
}

/// The change of a metric from one configuration to another, mean over the velocities, %.
pub fn mean_change_percent(
    outcomes: &[Outcome],
    knowledge: Knowledge,
    metric: Metric,
    from: Configuration,
    to: Configuration,
) -> Option<f64> {
    let value = |configuration, velocity| {
        find(outcomes, configuration, knowledge, velocity).map(|outcome| match metric {
            Metric::TrackingError => outcome.score.largest_mm,
            Metric::Glitch => outcome.score.glitch_mm,
        })
    };
    let changes: Option<Vec<f64>> = VELOCITIES_MM_S
        .into_iter()
        .map(|velocity| Some(change_percent(value(from, velocity)?, value(to, velocity)?)))
        .collect();
    let changes = changes?;
    Some(changes.iter().sum::<f64>() / changes.len() as f64)
}
