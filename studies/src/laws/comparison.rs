//! The tuned laws on the axis itself, each without and with feedforward.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::experiment::statistic::Statistic;
use quadrant_settings::AxisSettings;
use quadrant_sim::plant::AxisParameters;
use quadrant_sim::run::RunError;
use quadrant_sim::sine_test::{SineTest, SineTestOutcome, run_sine_tests};
use rayon::prelude::*;

use crate::laws::tuning::TunedLaw;

/// The sines of the comparison.
pub const SINES: [SineTest; 3] = [
    SineTest {
        amplitude_mm: 30.0,
        velocity_mm_s: 5.0,
    },
    SineTest {
        amplitude_mm: 30.0,
        velocity_mm_s: 10.0,
    },
    SineTest {
        amplitude_mm: 30.0,
        velocity_mm_s: 15.0,
    },
];

/// Result of one law with one feedforward.
#[derive(Clone, Debug)]
pub struct LawOutcome {
    pub law: LawKind,
    pub feedforward: FeedforwardKind,
    /// One a seed, and in it one a trial.
    pub outcomes: Vec<[SineTestOutcome; 3]>,
}

impl LawOutcome {
    /// A reading of every seed, mean over the trials, spread over the seeds.
    pub fn statistic(&self, read: impl Fn(&SineTestOutcome) -> f64) -> Statistic {
        let seeds: Vec<f64> = self
            .outcomes
            .iter()
            .map(|trials| trials.iter().map(&read).sum::<f64>() / trials.len() as f64)
            .collect();
        Statistic::of(&seeds)
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
    (settings, truth): (&AxisSettings, &AxisParameters),
    rate_hz: f64,
    seeds: std::ops::Range<u64>,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<LawOutcome>, RunError> {
    let runs: Vec<(usize, FeedforwardKind, u64)> = (0..laws.len())
        .flat_map(|law| feedforwards.iter().map(move |kind| (law, *kind)))
        .flat_map(|(law, kind)| seeds.clone().map(move |seed| (law, kind, seed)))
        .collect();
    let each = seeds.count().max(1);
    let outcomes: Vec<[SineTestOutcome; 3]> = runs
        .par_iter()
        .map(|&(law, kind, seed)| {
            let mut axis = settings.clone();
            axis.feedback = laws[law].feedback.clone();
            axis.feedforward.kind = kind;
            let axes = [axis.clone(), axis.clone(), axis];
            let outcome = run_sine_tests(axes, truth, SINES, rate_hz, seed);
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
