//! Cost of a coarser output: 16 bits, 12 bits, and 12 bits with the error of the past shaped away, on the thesis'
//! sines.

use clap::Args;
use quadrant_law::noise_shaper::NoiseShaper;
use quadrant_pages::compare::sine::{Bench, Outcome, Sines, VELOCITIES_MM_S, run_bench};
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::parts::UM_PER_MM;
use quadrant_report::{Block, Cell, Column, Section, Table};
use quadrant_sim::identified_stage::identified_settings;
use rayon::prelude::*;

use crate::study::{Advance, Study, results};

/// `quadrant-studies outputs`.
#[derive(Clone, Debug, Args)]
pub struct Outputs {}

impl Study for Outputs {
    const NAME: &'static str = "outputs";
    const TITLE: &'static str = "What a coarser output costs";
    const SUBTITLE: &'static str = "16 bits against 12 bits, plain and shaped";

    /// Runs PID, and N-PID with combined feedforward, behind every output, in parallel.
    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let setup = RunConfiguration::identified(identified_settings()?.stage);
        let runs: Vec<_> = Configuration::EXTREMES
            .into_iter()
            .flat_map(|configuration| Output::ALL.map(|output| (configuration, output)))
            .collect();
        let share = 1.0 / runs.len() as f64;
        let rows = runs
            .into_par_iter()
            .map(|(configuration, output)| {
                let sines = Sines::default();
                let mut bench = Bench::new(configuration, &setup, &sines, seed);
                if let Output::Bits12(shaper) = output {
                    bench.plant = bench.plant.behind_12_bits(shaper);
                }
                let outcomes = run_bench::<f32>(bench, configuration, &setup, &sines)?;
                advance(share);
                Ok(row(configuration, output, &outcomes))
            })
            .collect::<anyhow::Result<_>>()?;
        Ok(results(vec![Block::Table(table(rows))]))
    }
}

/// Conversion of codes to volts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Output {
    /// The external converter: every bit of the code.
    Bits16,
    /// The on-chip converter, with its words made in this way.
    Bits12(NoiseShaper),
}

impl Output {
    /// All, from the best to the cheapest.
    const ALL: [Self; 4] = [
        Self::Bits16,
        Self::Bits12(NoiseShaper::SecondOrder),
        Self::Bits12(NoiseShaper::FirstOrder),
        Self::Bits12(NoiseShaper::Rounded),
    ];

    /// Its name in tables.
    const fn name(self) -> &'static str {
        match self {
            Self::Bits16 => "16 bits",
            Self::Bits12(NoiseShaper::SecondOrder) => "12 bits, second order",
            Self::Bits12(NoiseShaper::FirstOrder) => "12 bits, first order",
            Self::Bits12(NoiseShaper::Rounded) => "12 bits, rounded",
        }
    }
}

/// Tracking errors at each velocity of the comparison.
fn row(configuration: Configuration, output: Output, outcomes: &[Outcome; 3]) -> Vec<Cell> {
    let errors = outcomes.iter().flat_map(|outcome| {
        [outcome.score.largest_mm, outcome.score.rms_mm]
            .map(|error_mm| Cell::number(error_mm * UM_PER_MM, 3))
    });
    [Cell::text(configuration.name()), Cell::text(output.name())]
        .into_iter()
        .chain(errors)
        .collect()
}

fn table(rows: Vec<Vec<Cell>>) -> Table {
    let velocities = VELOCITIES_MM_S.into_iter().flat_map(|velocity| {
        ["largest", "RMS"]
            .map(|metric| Column::with_unit(format!("{metric} at {velocity} mm/s"), "um"))
    });
    Table {
        id: "outputs".to_owned(),
        caption: "Tracking error with the identified model behind 16-bit and 12-bit outputs of +-10 V, at 10 kHz".to_owned(),
        columns: [Column::new("Configuration"), Column::new("Output")]
            .into_iter()
            .chain(velocities)
            .collect(),
        rows,
    }
}
