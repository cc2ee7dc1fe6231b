//! The command `quadrant identify plant`.

use std::path::PathBuf;

use clap::Args;
use quadrant_cli::output::Output;
use quadrant_pages::identify::linear::{fitted_response_section, plant_tables, response_section};
use quadrant_report::Block;
use quadrant_tune::identify::plant::{PlantFitSettings, Stiffness, fit_plant};
use quadrant_tune::identify::response::FrequencyResponse;

use super::frf::Measurement;
use super::recorded;
use crate::subject::{Destination, Subject};

/// Options of `quadrant identify plant`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// A measured response instead, as `quadrant identify frf` saves it.
    #[arg(long, visible_alias = "frf", value_name = "FILE")]
    record: Option<PathBuf>,
    /// Lowest coherence of a line that counts.
    #[arg(long, default_value_t = 0.9)]
    least_coherence: f64,
    /// The model's spring to ground.
    #[arg(long, value_enum, default_value_t = Stiffness::Zero)]
    stiffness: Stiffness,
    #[command(flatten)]
    measurement: Measurement,
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    output.ready()?;
    let settings = PlantFitSettings {
        least_coherence: arguments.least_coherence,
        stiffness: arguments.stiffness,
        ..PlantFitSettings::default()
    };
    let subject = &arguments.subject;
    let (found, mut section, title, stage) = match &arguments.record {
        Some(path) => {
            let response = FrequencyResponse::read_csv(path)?;
            let found = fit_plant(&response, &settings)?;
            let section = fitted_response_section(&response, &found);
            let title = recorded::title(std::slice::from_ref(path));
            (found, section, title, None)
        }
        None => {
            let start = subject.start_axis(arguments.destination.into.as_deref())?;
            let measured = arguments.measurement.run(subject, start.as_ref(), output)?;
            let response = &measured.found;
            let found = fit_plant(&response.estimate.response, &settings)?;
            let section = response_section(response, Some(&found));
            (found, section, measured.title, Some(measured.stage))
        }
    };
    let tables = plant_tables(&found);
    for table in &tables {
        output.table(table)?;
    }
    section.blocks.splice(0..0, tables.map(Block::Table));
    output.section("Linear model", &title, section, "plant.html")?;
    let records = arguments.record.as_slice();
    let destination = &arguments.destination;
    destination.write(subject, stage, records, &["plant"], |settings| {
        settings.plant = Some(found.plant);
    })
}
