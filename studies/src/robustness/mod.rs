//! Tracking of an axis that has changed since it was commissioned: named scenarios, and the laws that
//! compete in them.
//!
//! The settings of the competitors are those of the axis as it was commissioned and stay as they are while mass, friction,
//! delay, amplifier, encoder or load change. Only another drive is another machine: there each competitor gets the gains
//! and models that the same commissioning found on that drive.

pub mod command;
pub mod compliance;
pub mod drives;
mod error;
mod figures;
pub mod page;
pub mod scenario;
pub mod study;
mod trial;

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_law::safety::Fault;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::statistic::Statistic;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::metrics::Score;
use quadrant_sim::run::AxisTrace;
use rayon::prelude::*;

pub use error::RobustnessError;
pub use scenario::{Scenario, scenarios};
pub use trial::Task;
use trial::{Ended, Trial};

/// Request for the study.
#[derive(Clone, Debug)]
pub struct RobustnessRequest {
    /// The laws: name, and settings of the stage they were commissioned on.
    pub competitors: Vec<(String, StageSettings)>,
    /// The axis under test, 0 to 2.
    pub axis: usize,
    /// The scenarios; the first of a task is the one that changes are counted from.
    pub scenarios: Vec<Scenario>,
    /// Seed of the first run of each; the others follow it.
    pub seed: u64,
    /// Runs of each, 1 or more.
    pub seeds: u64,
}

/// Result of one competitor in one scenario.
#[derive(Clone, Debug)]
pub struct RobustnessOutcome {
    pub scenario: String,
    /// Task of the axis.
    pub task: Task,
    pub competitor: String,
    /// One a seed: the score, or the fault that switched the stage off.
    pub runs: Vec<Result<Score, Fault>>,
    /// The last cycle of a sine, or all of another task, of the first seed, where the scenario keeps it.
    pub trace: Option<AxisTrace>,
}

impl RobustnessOutcome {
    /// Mean and spread of what `read` finds in the scores of the runs that ended; nothing when none did, or where the task
    /// has no such score.
    pub fn statistic(&self, read: fn(&Score) -> f64) -> Option<Statistic> {
        let values: Vec<f64> = self.runs.iter().flatten().map(read).collect();
        (!values.is_empty())
            .then(|| Statistic::of(&values))
            .filter(|statistic| statistic.mean.is_finite())
    }

    /// The faults of the runs that did not end.
    pub fn faults(&self) -> Vec<Fault> {
        self.runs
            .iter()
            .filter_map(|run| run.as_ref().err().copied())
            .collect()
    }
}

/// The usual competitors: PID and N-PID, each without feedforward, with the combined one, and with one that learns.
pub fn usual_competitors(stage: &StageSettings) -> Vec<(String, StageSettings)> {
    let mut all = Vec::new();
    for controller in [LawKind::Pid, LawKind::NPid] {
        for (feedforward, learning) in [
            (FeedforwardKind::None, None),
            (FeedforwardKind::Combined, None),
            (FeedforwardKind::Combined, Some(LearningSettings::default())),
        ] {
            let configuration = Configuration {
                controller,
                feedforward,
                ..Configuration::PID
            };
            let mut settings = stage.clone();
            configuration.apply(&mut settings);
            let learns = if learning.is_some() { ", learning" } else { "" };
            for axis in &mut settings.axes {
                axis.feedforward.learning = learning;
            }
            all.push((format!("{}{learns}", configuration.name()), settings));
        }
    }
    all
}

/// The competitor's law on a machine that was commissioned as `found`: gains and models are the machine's; which feedforward
/// and which feedback law act, are the competitor's.
fn transferred(competitor: &AxisSettings, found: &AxisSettings) -> AxisSettings {
    let mut settings = found.clone();
    settings.feedforward.kind = competitor.feedforward.kind;
    settings.feedforward.learning = competitor.feedforward.learning;
    settings.feedback.law = competitor.feedback.law;
    settings
}

/// Runs every competitor in every scenario with every seed, in parallel; the same request gives the same outcomes, scenario by
/// scenario. A fault is a result. `progress` is called a run, of which there are [`RobustnessRequest::runs`].
///
/// # Errors
/// Settings that are refused, or a motion that does not end.
pub fn run_robustness(
    request: &RobustnessRequest,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<RobustnessOutcome>, RobustnessError> {
    let pairs: Vec<_> = request
        .scenarios
        .iter()
        .flat_map(|scenario| request.competitors.iter().map(move |c| (scenario, c)))
        .collect();
    pairs
        .into_par_iter()
        .map(|(scenario, (competitor, stage))| {
            let mut stage = stage.clone();
            let own = &stage.axes[request.axis];
            stage.axes[0] = match &scenario.commissioned {
                Some(found) => transferred(own, found),
                None => own.clone(),
            };
            let runs: Result<Vec<Ended>, RobustnessError> = (0..request.seeds)
                .into_par_iter()
                .map(|index| {
                    let trial = Trial {
                        stage: &stage,
                        truth: &scenario.truth,
                        load: &scenario.load,
                        task: scenario.task,
                        seed: request.seed.wrapping_add(index),
                    };
                    let ended = trial
                        .run()
                        .map_err(|stopped| stopped.named(competitor, &scenario.name));
                    progress();
                    // Traces are long: all but the requested ones go at once.
                    ended.map(|mut ended| {
                        if index > 0 || !scenario.keeps_trace {
                            ended.trace = None;
                        }
                        ended
                    })
                })
                .collect();
            let mut runs = runs?;
            Ok(RobustnessOutcome {
                scenario: scenario.name.clone(),
                task: scenario.task,
                competitor: competitor.clone(),
                trace: runs.first_mut().and_then(|ended| ended.trace.take()),
                runs: runs.into_iter().map(|ended| ended.score).collect(),
            })
        })
        .collect()
}

impl RobustnessRequest {
    pub fn runs(&self) -> u64 {
        (self.scenarios.len() * self.competitors.len()) as u64 * self.seeds
    }
}

/// The outcome of a competitor in a scenario.
pub fn find<'a>(
    outcomes: &'a [RobustnessOutcome],
    scenario: &str,
    competitor: &str,
) -> Option<&'a RobustnessOutcome> {
    outcomes
        .iter()
        .find(|outcome| outcome.scenario == scenario && outcome.competitor == competitor)
}

/// Returns the outcome that changes are counted from: the same competitor in the first scenario with the same task.
pub fn baseline<'a>(
    outcomes: &'a [RobustnessOutcome],
    outcome: &RobustnessOutcome,
) -> Option<&'a RobustnessOutcome> {
    outcomes
        .iter()
        .find(|other| other.task == outcome.task && other.competitor == outcome.competitor)
}
