//! Tracking of an axis that has changed since it was commissioned: named scenarios, and the laws that compete in them.
//!
//! The settings of the competitors are those of the axis as it was commissioned and stay as they are while mass, friction,
//! delay, amplifier, encoder or load change.

mod page;
pub mod scenario;
mod trial;

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::law_settings::LawSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::safety::Fault;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::statistic::Statistic;
use quadrant_report::Section;
use quadrant_settings::StageSettings;
use quadrant_sim::metrics::Score;
use quadrant_sim::plant::load::Force;
use quadrant_tune::record::ForceRecord;
use rayon::prelude::*;

use crate::competitor::Feedforward;
use crate::study::{Advance, Study, results};
pub use scenario::{Scenario, scenarios};
pub use trial::Task;
use trial::Trial;

/// `quadrant-studies robustness`.
#[derive(Clone, Debug, Args)]
pub struct Robustness {
    /// The axis of the simulated stage.
    #[arg(long, value_enum, default_value = "x")]
    axis: Axis,
    #[command(flatten)]
    settings: LawSettings,
    /// Runs of each scenario and law, with a seed each, 1 to 100.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Recorded force on the table, CSV: t_s, even, and force_x_n, force_y_n or force_z_n, in N; repeated as long as it
    /// takes.
    #[arg(long, value_name = "FILE")]
    force: Option<PathBuf>,
    /// Run only scenarios whose name contains this, and those that changes are counted from.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
}

/// Scenarios that changes are counted from, one of each task.
const REFERENCES: [&str; 3] = ["nominal", "hold", "slow feed"];

impl Study for Robustness {
    const NAME: &'static str = "robustness";
    const TITLE: &'static str = "Robustness on the simulated stage";
    const SUBTITLE: &'static str = "PID and N-PID, with and without friction compensation, on an axis that is no longer what it was";

    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let mut scenarios = scenarios(self.axis.index(), self.recorded_force()?);
        if let Some(text) = &self.only {
            let names: Vec<String> = scenarios.iter().map(|it| it.name.clone()).collect();
            if !names.iter().any(|name| name.contains(text)) {
                bail!("no scenario's name contains {text:?}: they are {names:?}");
            }
            scenarios.retain(|it| it.name.contains(text) || REFERENCES.contains(&it.name.as_str()));
        }
        let request = Request {
            competitors: usual_competitors(&self.settings.read()?.stage),
            axis: self.axis.index(),
            scenarios,
            seed,
            seeds: self.seeds,
        };
        let outcomes = run(&request, advance)?;
        Ok(results(page::blocks(&request, &outcomes)))
    }
}

impl Robustness {
    /// The force of the file along the axis.
    fn recorded_force(&self) -> anyhow::Result<Option<Force>> {
        let Some(path) = &self.force else {
            return Ok(None);
        };
        let force = ForceRecord::read_csv(path)?.axes[self.axis.index()].take();
        let name = self.axis.name();
        let force = force.with_context(|| {
            format!(
                "{}: there is no column force_{name}_n for the {name} axis; add it, or choose another --axis",
                path.display(),
            )
        })?;
        Ok(Some(force))
    }
}

/// The runs of a study.
#[derive(Clone, Debug)]
pub struct Request {
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
pub struct Outcome {
    pub scenario: String,
    /// Task of the axis.
    pub task: Task,
    pub competitor: String,
    /// One a seed: the score, or the fault that switched the stage off.
    pub runs: Vec<Result<Score, Fault>>,
}

impl Outcome {
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
        let faults = self.runs.iter().filter_map(|run| run.as_ref().err());
        faults.copied().collect()
    }
}

/// The usual competitors: PID and N-PID, each with each feedforward.
pub fn usual_competitors(stage: &StageSettings) -> Vec<(String, StageSettings)> {
    [LawKind::Pid, LawKind::NPid]
        .into_iter()
        .flat_map(|controller| Feedforward::ALL.map(|feedforward| (controller, feedforward)))
        .map(|(controller, feedforward)| {
            let configuration = Configuration {
                controller,
                feedforward: feedforward.kind(),
                ..Configuration::PID
            };
            let mut settings = stage.clone();
            configuration.apply(&mut settings);
            for axis in &mut settings.axes {
                feedforward.apply(axis);
            }
            let learns = match feedforward {
                Feedforward::Learning => ", learning",
                Feedforward::Without | Feedforward::Fixed => "",
            };
            (format!("{}{learns}", configuration.name()), settings)
        })
        .collect()
}

/// Runs every competitor in every scenario with every seed, in parallel; the same request gives the same outcomes, scenario by
/// scenario. A fault is a result. `advance` receives shares of the whole.
///
/// # Errors
/// Settings that are refused, or a motion that does not end.
pub fn run(request: &Request, advance: Advance<'_>) -> anyhow::Result<Vec<Outcome>> {
    let pairs: Vec<_> = request
        .scenarios
        .iter()
        .flat_map(|scenario| request.competitors.iter().map(move |it| (scenario, it)))
        .collect();
    let share = 1.0 / (pairs.len() as u64 * request.seeds) as f64;
    pairs
        .into_par_iter()
        .map(|(scenario, (competitor, stage))| {
            let mut stage = stage.clone();
            stage.axes[0] = stage.axes[request.axis].clone();
            let runs = (0..request.seeds)
                .into_par_iter()
                .map(|index| {
                    let trial = Trial {
                        stage: &stage,
                        scenario,
                        seed: request.seed.wrapping_add(index),
                    };
                    let ended = trial
                        .run()
                        .with_context(|| format!("{competitor} in the scenario {}", scenario.name));
                    advance(share);
                    ended
                })
                .collect::<anyhow::Result<_>>()?;
            Ok(Outcome {
                scenario: scenario.name.clone(),
                task: scenario.task,
                competitor: competitor.clone(),
                runs,
            })
        })
        .collect()
}

/// The outcome of a competitor in a scenario.
pub fn find<'a>(outcomes: &'a [Outcome], scenario: &str, competitor: &str) -> Option<&'a Outcome> {
    outcomes
        .iter()
        .find(|outcome| outcome.scenario == scenario && outcome.competitor == competitor)
}

/// Returns the outcome that changes are counted from: the same competitor in the first scenario with the same task.
pub fn baseline<'a>(outcomes: &'a [Outcome], outcome: &Outcome) -> Option<&'a Outcome> {
    outcomes
        .iter()
        .find(|other| other.task == outcome.task && other.competitor == outcome.competitor)
}
