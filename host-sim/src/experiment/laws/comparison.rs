//! The tuned laws on the axis itself, each without and with feedforward.

use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::settings::AxisSettings;
use rayon::prelude::*;

use super::tuning::TunedLaw;
use crate::experiment::run::RunError;
use crate::experiment::trial::{Trial, TrialOutcome, try_three};
use crate::plant::AxisTruth;

/// The sines of the comparison.
pub const TRIALS: [Trial; 3] = [
    Trial {
        amplitude_mm: 30.0,
        velocity_mm_s: 5.0,
    },
    Trial {
        amplitude_mm: 30.0,
        velocity_mm_s: 10.0,
    },
    Trial {
        amplitude_mm: 30.0,
        velocity_mm_s: 15.0,
    },
];

/// What one law did, with one feedforward.
#[derive(Clone, Debug)]
pub struct LawOutcome {
    /// The law.
    pub law: LawKind,
    /// The feedforward.
    pub feedforward: FeedforwardKind,
    /// One a seed, and in it one a trial.
    pub outcomes: Vec<[TrialOutcome; 3]>,
}

/// Mean and standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation; zero of a single value.
    pub deviation: f64,
}

impl Spread {
    /// Of some values.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self {
            mean,
            deviation: (squares / (count - 1.0).max(1.0)).sqrt(),
        }
    }
}

impl LawOutcome {
    /// A reading of every seed, mean over the trials, spread over the seeds.
    pub fn spread(&self, read: impl Fn(&TrialOutcome) -> f64) -> Spread {
        let seeds: Vec<f64> = self
            .outcomes
            .iter()
            .map(|trials| trials.iter().map(&read).sum::<f64>() / trials.len() as f64)
            .collect();
        Spread::of(&seeds)
    }
}

/// Runs every tuned law with each of `feedforwards` on the axis, `settings` being all else, in parallel; seeds count from
/// `seed` on. `progress` is called once a run.
///
/// # Errors
/// Refused settings or a fault.
pub fn compare_laws(
    laws: &[TunedLaw],
    feedforwards: &[FeedforwardKind],
    (settings, truth): (&AxisSettings, &AxisTruth),
    rate_hz: f64,
    seeds: std::ops::Range<u64>,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<LawOutcome>, RunError> {
    let runs: Vec<(usize, FeedforwardKind, u64)> = (0..laws.len())
        .flat_map(|law| feedforwards.iter().map(move |kind| (law, *kind)))
        .flat_map(|(law, kind)| seeds.clone().map(move |seed| (law, kind, seed)))
        .collect();
    let each = seeds.count().max(1);
    let outcomes: Vec<[TrialOutcome; 3]> = runs
        .par_iter()
        .map(|&(law, kind, seed)| {
            let mut axis = settings.clone();
            axis.feedback = laws[law].feedback.clone();
            axis.feedforward.kind = kind;
            let axes = [axis.clone(), axis.clone(), axis];
            let outcome = try_three(axes, truth, TRIALS, rate_hz, seed);
            progress();
            outcome
        })
        .collect::<Result<_, _>>()?;
    Ok(runs
        .chunks(each)
        .zip(outcomes.chunks(each))
        .map(|(runs, outcomes)| LawOutcome {
            law: laws[runs[0].0].law,
            feedforward: runs[0].1,
            outcomes: outcomes.to_vec(),
        })
        .collect())
}
