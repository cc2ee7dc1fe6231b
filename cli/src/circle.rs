//! `quadrant circle`.

use crate::numbers::{self, Numbers};
use crate::plane::PlaneName;
use anyhow::{Context, ensure};
use clap::Args;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, command_line, progress};
use quadrant_cli::say;
use quadrant_sim::circle::page::{circle_page, circle_tables};
use quadrant_sim::circle::{CircleRequest, run_circle_tests};
use quadrant_sim::experiment::configuration::Configuration;
use quadrant_sim::experiment::run_configuration::RunConfiguration;
use quadrant_sim::pages::provenance;

/// Options of `quadrant circle`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// Planes, separated by commas.
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["xy", "yz", "zx"], value_name = "PLANES")]
    plane: Vec<PlaneName>,
    /// Radii, mm, separated by commas.
    #[arg(long, default_values_t = [Numbers(vec![5.0, 15.0, 30.0, 50.0])], value_name = "MM,...")]
    radius_mm: Vec<Numbers>,
    /// Feeds along the path, mm/min, separated by commas.
    #[arg(long, default_values_t = [Numbers(vec![300.0, 1000.0, 3000.0])], value_name = "MM/MIN,...")]
    feed_mm_min: Vec<Numbers>,
    /// Run the thesis' eight configurations beside the best PID, not only its PID alone and N-PID with static and GMS feedforward.
    #[arg(long)]
    all: bool,
    /// Number of noise seeds, from --seed on, 1 to 100; with several, tables give means and spreads over them.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    #[command(flatten)]
    settings: LawSettings,
    #[command(flatten)]
    output: Output,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    output.ready()?;
    let radii_mm = numbers::all(&arguments.radius_mm);
    let feeds_mm_min = numbers::all(&arguments.feed_mm_min);
    for (option, values) in [("--radius-mm", &radii_mm), ("--feed-mm-min", &feeds_mm_min)] {
        for value in values {
            ensure!(
                *value > 0.0 && value.is_finite(),
                "{option} {value} must be a number above zero"
            );
        }
    }
    let stage = arguments.settings.read()?.stage;
    let setup = RunConfiguration::identified(stage).with_best_pid()?;
    let last_seed = output.seed.checked_add(arguments.seeds - 1);
    let last_seed =
        last_seed.context("--seed plus --seeds is beyond 2^64; choose a smaller one")?;
    let request = CircleRequest {
        planes: arguments.plane.iter().map(|name| name.plane()).collect(),
        radii_mm,
        feeds_mm_min,
        configurations: if arguments.all {
            Configuration::with_best_pid()
        } else {
            Configuration::USUAL.to_vec()
        },
        seeds: (output.seed..=last_seed).collect(),
    };
    let bar = progress(request.cases().len() as u64, "running circles");
    let results = run_circle_tests(&request, &setup, &|| bar.inc(1));
    bar.finish_and_clear();
    say!(
        "Simulated, not measured. 10 kHz, f32; seed {}\n",
        output.seed
    );
    for table in circle_tables(&results) {
        output.table(&table)?;
    }
    ensure!(
        results.iter().any(|result| result.outcome.is_ok()),
        "no circle was run to its end; the table above says why"
    );
    let page = circle_page(&results, provenance(&command_line(), output.seed));
    output.page(&page, "circle.html")
}
