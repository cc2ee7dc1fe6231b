//! The table of the outputs.

use quadrant_pages::compare::sine::VELOCITIES_MM_S;
use quadrant_pages::parts::UM_PER_MM;
use quadrant_report::{Cell, Column, Table};

use crate::outputs::OutputRun;

/// Tracking error behind each output, configuration by configuration.
pub fn outputs_table(runs: &[OutputRun]) -> Table {
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
        rows: runs
            .iter()
            .map(|run| {
                let [first, ..] = &run.outcomes;
                [
                    Cell::text(first.configuration.name()),
                    Cell::text(run.output.name()),
                ]
                .into_iter()
                .chain(run.outcomes.iter().flat_map(|outcome| {
                    [outcome.score.largest_mm, outcome.score.rms_mm]
                        .map(|error_mm| Cell::number(error_mm * UM_PER_MM, 3))
                }))
                .collect()
            })
            .collect(),
    }
}
