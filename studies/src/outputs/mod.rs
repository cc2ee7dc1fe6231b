//! Cost of a coarser output: 16 bits, 12 bits, and 12 bits with the error of the past shaped away, on the thesis'
//! sines.

pub mod command;
pub mod page;

use quadrant_law::noise_shaper::NoiseShaper;
use quadrant_pages::compare::sine::{Bench, Outcome, Sines, run_bench};
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_sim::run::RunError;
use rayon::prelude::*;

/// Conversion of codes to volts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The external converter: every bit of the code.
    Bits16,
    /// The on-chip converter, with its words made in this way.
    Bits12(NoiseShaper),
}

impl Output {
    /// All, from the best to the cheapest.
    pub const ALL: [Self; 4] = [
        Self::Bits16,
        Self::Bits12(NoiseShaper::SecondOrder),
        Self::Bits12(NoiseShaper::FirstOrder),
        Self::Bits12(NoiseShaper::Rounded),
    ];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bits16 => "16 bits",
            Self::Bits12(NoiseShaper::SecondOrder) => "12 bits, second order",
            Self::Bits12(NoiseShaper::FirstOrder) => "12 bits, first order",
            Self::Bits12(NoiseShaper::Rounded) => "12 bits, rounded",
        }
    }
}

/// Result of one output.
#[derive(Clone, Debug)]
pub struct OutputRun {
    pub output: Output,
    /// One outcome for each velocity of the comparison.
    pub outcomes: [Outcome; 3],
}

/// Runs PID, and N-PID with combined feedforward, behind every output, in parallel.
///
/// # Errors
/// The first refused setting or fault.
pub fn run_all(setup: &RunConfiguration, seed: u64) -> Result<Vec<OutputRun>, RunError> {
    let runs: Vec<_> = Configuration::EXTREMES
        .into_iter()
        .flat_map(|configuration| Output::ALL.map(|output| (configuration, output)))
        .collect();
    runs.into_par_iter()
        .map(|(configuration, output)| {
            let sines = Sines::default();
            let mut bench = Bench::new(configuration, setup, &sines, seed);
            if let Output::Bits12(shaper) = output {
                bench.plant = bench.plant.behind_12_bits(shaper);
            }
            Ok(OutputRun {
                output,
                outcomes: run_bench::<f32>(bench, configuration, setup, &sines)?,
            })
        })
        .collect()
}
