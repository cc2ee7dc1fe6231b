//! The runs of the comparison: configurations, with the exact and with the identified model, on sines, repeated with
//! several seeds of the noise.
//!
//! A run with the exact model has no noise and starts at rest at the origin: a second one would repeat the first to the
//! bit. It is run once, and its scores have no spread. One with the identified model is run once for each seed.

use quadrant_sim::metrics::{Metric, Score, change_percent};
use quadrant_sim::run::{AxisTrace, RunError};
use rayon::prelude::*;

use crate::compare::sine::{Outcome, Sines, run_sines};
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use crate::experiment::statistic::Statistic;

/// Amplitudes of the sine, mm: that of most of the chapter, and that of Tables 5.21 and 5.22.
pub const AMPLITUDES_MM: [f64; 2] = [30.0, 15.0];

/// Seconds that a run takes on two cores of a current machine, for each second of its longest cycle.
const SECONDS_PER_CYCLE_S: f64 = 0.0072;

/// Result of one configuration on one sine.
#[derive(Clone, Debug)]
pub struct Entry {
    pub configuration: Configuration,
    /// The law's knowledge of the plant.
    pub knowledge: ModelKnowledge,
    /// Amplitude of the sine, mm.
    pub amplitude_mm: f64,
    /// Largest velocity of the sine, mm/s.
    pub velocity_mm_s: f64,
    /// The scores, one for each seed.
    pub scores: Vec<Score>,
    /// The last scored cycle of the first seed; it begins at a reversal.
    pub last_cycle: AxisTrace,
}

impl Entry {
    /// Mean and deviation of one metric.
    pub fn statistic(&self, read: fn(&Score) -> f64) -> Statistic {
        Statistic::of(&self.scores.iter().map(read).collect::<Vec<_>>())
    }
}

/// Runs to be made.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The stages, each with the settings of its law.
    pub setups: &'a [RunConfiguration],
    pub configurations: &'a [Configuration],
    pub sines: Vec<Sines>,
    /// The first seed of the noise; the others follow it.
    pub seed: u64,
    /// Number of seeds, one at least.
    pub seeds: u64,
}

/// One run of a request.
struct Run<'a> {
    setup: &'a RunConfiguration,
    sines: &'a Sines,
    configuration: Configuration,
    seed: u64,
}

impl Request<'_> {
    /// Seeds that a kind of knowledge is run with: a run without noise is run once.
    fn seeds_of(&self, knowledge: ModelKnowledge) -> u64 {
        match knowledge {
            ModelKnowledge::Exact => 1,
            ModelKnowledge::Identified => self.seeds.max(1),
        }
    }

    /// All runs, those of one entry one after the other.
    fn runs(&self) -> Vec<Run<'_>> {
        let mut runs = Vec::new();
        for setup in self.setups {
            for sines in &self.sines {
                for &configuration in self.configurations {
                    runs.extend((0..self.seeds_of(setup.knowledge)).map(|further| Run {
                        setup,
                        sines,
                        configuration,
                        seed: self.seed.wrapping_add(further),
                    }));
                }
            }
        }
        runs
    }

    /// Runs everything, in parallel; the same request gives the same entries. `advance` receives the share of the whole
    /// that each finished run was.
    ///
    /// # Errors
    /// The first refused setting or fault.
    pub fn run(&self, advance: &(dyn Fn(f64) + Sync)) -> Result<Comparison, RunError> {
        let runs = self.runs();
        let whole_s: f64 = runs.iter().map(Run::expected_s).sum();
        let outcomes: Vec<Vec<Outcome>> = runs
            .par_iter()
            .map(|run| {
                let Run {
                    setup,
                    sines,
                    configuration,
                    seed,
                } = *run;
                let outcomes = run_sines::<f32>(configuration, setup, sines, seed)?;
                let count = sines.velocities_mm_s.len();
                let mut outcomes: Vec<Outcome> = outcomes.into_iter().take(count).collect();
                if seed != self.seed {
                    // One trace is drawn; the others would only fill the memory.
                    outcomes
                        .iter_mut()
                        .for_each(|outcome| outcome.last_cycle = AxisTrace::default());
                }
                advance(run.expected_s() / whole_s);
                Ok(outcomes)
            })
            .collect::<Result<_, RunError>>()?;
        let mut comparison = Comparison::default();
        for outcome in outcomes.into_iter().flatten() {
            comparison.add(outcome);
        }
        Ok(comparison)
    }
}

impl Run<'_> {
    fn expected_s(&self) -> f64 {
        SECONDS_PER_CYCLE_S * self.sines.longest_cycle_s()
    }
}

/// Results of all configurations.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    entries: Vec<Entry>,
}

impl From<Vec<Entry>> for Comparison {
    fn from(entries: Vec<Entry>) -> Self {
        Self { entries }
    }
}

impl Comparison {
    fn add(&mut self, outcome: Outcome) {
        let Outcome {
            configuration,
            knowledge,
            amplitude_mm,
            velocity_mm_s,
            score,
            last_cycle,
        } = outcome;
        let place = self.place(configuration, knowledge, amplitude_mm, velocity_mm_s);
        match place {
            Some(place) => self.entries[place].scores.push(score),
            None => self.entries.push(Entry {
                configuration,
                knowledge,
                amplitude_mm,
                velocity_mm_s,
                scores: vec![score],
                last_cycle,
            }),
        }
    }

    fn place(
        &self,
        configuration: Configuration,
        knowledge: ModelKnowledge,
        amplitude_mm: f64,
        velocity_mm_s: f64,
    ) -> Option<usize> {
        self.entries.iter().position(|entry| {
            entry.configuration == configuration
                && entry.knowledge == knowledge
                && entry.amplitude_mm == amplitude_mm
                && entry.velocity_mm_s == velocity_mm_s
        })
    }

    /// Result of a configuration on one sine; nothing if that was not run.
    pub fn find(
        &self,
        configuration: Configuration,
        knowledge: ModelKnowledge,
        amplitude_mm: f64,
        velocity_mm_s: f64,
    ) -> Option<&Entry> {
        self.place(configuration, knowledge, amplitude_mm, velocity_mm_s)
            .map(|place| &self.entries[place])
    }

    /// The changes of a metric from one configuration to another on sines of the first amplitude, %: run by run with the
    /// same noise, mean over the velocities; nothing if one of them was not run.
    pub fn changes_percent(
        &self,
        knowledge: ModelKnowledge,
        metric: Metric,
        [from, to]: [Configuration; 2],
        velocities_mm_s: &[f64],
    ) -> Option<Statistic> {
        let mut of_seeds: Vec<f64> = Vec::new();
        for &velocity in velocities_mm_s {
            let find =
                |configuration| self.find(configuration, knowledge, AMPLITUDES_MM[0], velocity);
            let (before, after) = (find(from)?, find(to)?);
            of_seeds.resize(before.scores.len(), 0.0);
            for ((sum, before), after) in of_seeds.iter_mut().zip(&before.scores).zip(&after.scores)
            {
                *sum += change_percent((metric.read)(before), (metric.read)(after));
            }
        }
        for sum in &mut of_seeds {
            *sum /= velocities_mm_s.len() as f64;
        }
        (!of_seeds.is_empty()).then(|| Statistic::of(&of_seeds))
    }

    /// Takes in what was run besides.
    pub fn join(&mut self, other: Self) {
        self.entries.extend(other.entries);
    }

    /// Everything that was run.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quadrant_sim::identified_stage::identified_settings;

    #[test]
    fn a_run_with_the_exact_model_is_not_repeated_and_every_entry_has_its_seeds() {
        let setups = RunConfiguration::both(&identified_settings().unwrap().stage);
        let configurations = [Configuration::all()[0], Configuration::all()[7]];
        let request = Request {
            setups: &setups,
            configurations: &configurations,
            sines: [1.0, 0.5].map(Sines::of_amplitude).to_vec(),
            seed: 3,
            seeds: 2,
        };
        let shares = std::sync::Mutex::new(0.0);
        let comparison = request
            .run(&|share| *shares.lock().unwrap() += share)
            .unwrap();
        assert!((shares.into_inner().unwrap() - 1.0_f64).abs() < 1e-9);
        assert_eq!(comparison.entries().len(), 2 * 2 * 2 * 3);
        for entry in comparison.entries() {
            let seeds = match entry.knowledge {
                ModelKnowledge::Exact => 1,
                ModelKnowledge::Identified => 2,
            };
            assert_eq!(entry.scores.len(), seeds);
            assert!(!entry.last_cycle.error_mm.is_empty());
        }
    }
}
