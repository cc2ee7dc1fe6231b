//! Cost of the number type: `f32` and fixed point against `f64`, over the whole comparison.
//!
//! *Output*: all three laws read the same counts, those of the stage under the `f64` law, so the difference is the
//! arithmetic's alone. *Tracking error*: each law runs its own stage in closed loop with the same noise, and the error
//! over time and the score are compared.

use clap::Args;
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_pages::compare::sine::{Bench, Outcome, Sines, run_configuration};
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::parts::UM_PER_MM;
use quadrant_report::{Block, Cell, Column, Section, Table};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::law_machine::TickInput;
use quadrant_sim::run::ELEMENTS;
use quadrant_sim::run::RunError;
use rayon::prelude::*;

use crate::study::{Advance, Study, results};

/// `quadrant-studies numerics`.
#[derive(Clone, Debug, Args)]
pub struct NumberTypes {}

impl Study for NumberTypes {
    const NAME: &'static str = "numerics";
    const TITLE: &'static str = "What the number type costs";
    const SUBTITLE: &'static str = "f32 and fixed point against f64 over the whole comparison";

    /// Runs the whole comparison in all number types, in parallel.
    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let setups = RunConfiguration::both(&identified_settings()?.stage);
        let configurations = Configuration::all();
        let share = 1.0 / configurations.len() as f64;
        let rows: Result<Vec<_>, RunError> = configurations
            .into_par_iter()
            .map(|configuration| {
                let numerics = Numerics::new(configuration, &setups, seed)?;
                advance(share);
                Ok(numerics.row())
            })
            .collect();
        Ok(results(vec![Block::Table(table(rows?))]))
    }
}

const UV_PER_V: f64 = 1e6;

/// Deviation of a number type from `f64`: the worst over all velocities and both kinds of model knowledge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Deviation {
    /// Output on the same counts, V.
    output_v: f64,
    /// Converter words on the same counts that differ, and words in all.
    words: (u64, u64),
    /// Tracking error at the same time in closed loop, mm.
    error_mm: f64,
    /// Score in closed loop: largest tracking error, mm.
    largest_mm: f64,
    /// Score in closed loop: RMS tracking error, mm.
    rms_mm: f64,
}

impl Deviation {
    fn cells(&self) -> [Cell; 5] {
        let (differing, all) = self.words;
        [
            Cell::number(self.output_v * UV_PER_V, 1),
            Cell::number(100.0 * differing as f64 / all as f64, 2),
            Cell::number(self.error_mm * UM_PER_MM, 3),
            Cell::number(self.largest_mm * UM_PER_MM, 3),
            Cell::number(self.rms_mm * UM_PER_MM, 4),
        ]
    }

    fn worst(self, other: Self) -> Self {
        Self {
            output_v: self.output_v.max(other.output_v),
            words: (self.words.0 + other.words.0, self.words.1 + other.words.1),
            error_mm: self.error_mm.max(other.error_mm),
            largest_mm: self.largest_mm.max(other.largest_mm),
            rms_mm: self.rms_mm.max(other.rms_mm),
        }
    }
}

/// Deviations of the number types under one configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Numerics {
    configuration: Configuration,
    /// `f32`.
    single: Deviation,
    fixed: Deviation,
}

impl Numerics {
    fn new(
        configuration: Configuration,
        setups: &[RunConfiguration],
        seed: u64,
    ) -> Result<Self, RunError> {
        let mut numerics = Self {
            configuration,
            single: Deviation::default(),
            fixed: Deviation::default(),
        };
        for setup in setups {
            shadow(&mut numerics, setup, seed)?;
            let exact = run_configuration::<f64>(configuration, setup, seed)?;
            let single = run_configuration::<f32>(configuration, setup, seed)?;
            let fixed = run_configuration::<Fixed>(configuration, setup, seed)?;
            numerics.single = numerics.single.worst(closed_loop(&exact, &single));
            numerics.fixed = numerics.fixed.worst(closed_loop(&exact, &fixed));
        }
        Ok(numerics)
    }

    fn row(&self) -> Vec<Cell> {
        let mut row = vec![Cell::text(self.configuration.name())];
        row.extend(self.single.cells());
        row.extend(self.fixed.cells());
        row
    }
}

/// Lets the `f64` law drive the stage, and the others compute from the same counts.
fn shadow(numerics: &mut Numerics, setup: &RunConfiguration, seed: u64) -> Result<(), RunError> {
    let Bench {
        job,
        mut plant,
        most_ticks,
        mut operator,
    } = Bench::new(numerics.configuration, setup, &Sines::default(), seed);
    let mut exact = LawMachine::<f64, ELEMENTS>::new(&job)?;
    let mut single = LawMachine::<f32, ELEMENTS>::new(&job)?;
    let mut fixed = LawMachine::<Fixed, ELEMENTS>::new(&job)?;
    for tick in 0..most_ticks {
        let input = TickInput::of_counts(plant.read_counters(), operator.request(tick as u32));
        let outputs = exact.tick(&input);
        single.tick(&input);
        fixed.tick(&input);
        differ(&exact, &single, &mut numerics.single);
        differ(&exact, &fixed, &mut numerics.fixed);
        plant.step(&outputs);
    }
    Ok(())
}

fn differ<S: Scalar>(
    exact: &LawMachine<f64, ELEMENTS>,
    other: &LawMachine<S, ELEMENTS>,
    deviation: &mut Deviation,
) {
    let axes = exact.state().axes().iter().zip(other.state().axes());
    for (exact, other) in axes {
        let (exact, other) = (exact.telemetry(), other.telemetry());
        let output_v = other.output.to_f64(quadrant_law::scalar::Quantity::Voltage);
        deviation.output_v = deviation.output_v.max((output_v - exact.output).abs());
        deviation.words.0 += u64::from(exact.code != other.code);
        deviation.words.1 += 1;
    }
}

fn closed_loop(exact: &[Outcome; 3], other: &[Outcome; 3]) -> Deviation {
    exact
        .iter()
        .zip(other)
        .map(|(exact, other)| {
            let errors = exact
                .last_cycle
                .error_mm
                .iter()
                .zip(&other.last_cycle.error_mm);
            Deviation {
                error_mm: errors.fold(0.0, |worst, (a, b)| (a - b).abs().max(worst)),
                largest_mm: (exact.score.largest_mm - other.score.largest_mm).abs(),
                rms_mm: (exact.score.rms_mm - other.score.rms_mm).abs(),
                ..Deviation::default()
            }
        })
        .fold(Deviation::default(), Deviation::worst)
}

/// Worst deviations from `f64`, configuration by configuration.
fn table(rows: Vec<Vec<Cell>>) -> Table {
    let columns = ["f32", "fixed"].map(|name| {
        [
            Column::with_unit(format!("{name} output"), "uV"),
            Column::with_unit(format!("{name} words"), "%"),
            Column::with_unit(format!("{name} error over time"), "um"),
            Column::with_unit(format!("{name} largest error"), "um"),
            Column::with_unit(format!("{name} RMS error"), "um"),
        ]
    });
    Table {
        id: "numerics".to_owned(),
        caption: "Simulated, x axis. f32 and fixed point against f64 over the whole comparison, worst values. Output and differing words: \
                  on the same counts. Tracking error: each in closed loop on its own stage, at the same time, and as \
                  scores"
            .to_owned(),
        columns: std::iter::once(Column::new("Configuration"))
            .chain(columns.into_iter().flatten())
            .collect(),
        rows,
    }
}
