//! `quadrant identify plant`.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::command::axis::Axis;
use quadrant_sim::command::output::{Output, command_line};
use quadrant_sim::identify::pages::linear::{
    fitted_response_section, plant_tables, response_section,
};
use quadrant_sim::identify::plant::{PlantFitSettings, Stiffness, fit_plant};
use quadrant_sim::identify::response::FrequencyResponse;
use quadrant_sim::pages::provenance;
use quadrant_sim::report::Block;

use super::frf::Measurement;
use super::{page, simulated};

/// Options of `quadrant identify plant`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage, whose response is measured first.
    #[arg(
        long,
        value_enum,
        required_unless_present = "frf",
        conflicts_with = "frf"
    )]
    axis: Option<Axis>,
    /// A measured response, as `quadrant identify frf` saves it.
    #[arg(long, value_name = "FILE")]
    frf: Option<PathBuf>,
    /// Lowest coherence of a line that counts.
    #[arg(long, default_value_t = 0.9)]
    least_coherence: f64,
    /// Whether the model has a spring to ground.
    #[arg(long, value_enum, default_value_t = Stiffness::Zero)]
    stiffness: Stiffness,
    #[command(flatten)]
    measurement: Measurement,
    #[command(flatten)]
    output: Output,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let settings = PlantFitSettings {
        least_coherence: arguments.least_coherence,
        stiffness: arguments.stiffness,
        ..PlantFitSettings::default()
    };
    let (found, mut section, title) = match (&arguments.frf, arguments.axis) {
        (Some(path), _) => {
            let response = FrequencyResponse::read_csv(path)?;
            let found = fit_plant(&response, &settings)?;
            let section = fitted_response_section(&response, &found.plant);
            let name = path.file_name().unwrap_or(path.as_os_str()).display();
            (found, section, format!("recorded: {name}"))
        }
        (None, Some(axis)) => {
            let measured = arguments.measurement.run(axis, output)?;
            println!("Simulated, not measured.");
            let found = fit_plant(&measured.estimate.response, &settings)?;
            let section = response_section(&measured, Some(&found.plant));
            (found, section, simulated(axis))
        }
        (None, None) => return Ok(()),
    };
    let tables = plant_tables(&found);
    for table in &tables {
        output.table(table)?;
    }
    section.blocks.splice(0..0, tables.map(Block::Table));
    let page = page(
        "Linear model",
        &title,
        vec![section],
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "plant.html")
}
