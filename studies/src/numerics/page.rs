//! The table of the number types.

use quadrant_pages::parts::UM_PER_MM;
use quadrant_report::{Cell, Column, Table};

use crate::numerics::{Deviation, Numerics};

const UV_PER_V: f64 = 1e6;

/// Worst deviations from `f64`, configuration by configuration.
pub fn numerics_table(numerics: &[Numerics]) -> Table {
    let cells = |deviation: &Deviation| {
        let (differing, all) = deviation.words;
        [
            Cell::number(deviation.output_v * UV_PER_V, 1),
            Cell::number(100.0 * differing as f64 / all as f64, 2),
            Cell::number(deviation.error_mm * UM_PER_MM, 3),
            Cell::number(deviation.largest_mm * UM_PER_MM, 3),
            Cell::number(deviation.rms_mm * UM_PER_MM, 4),
        ]
    };
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
        columns: [Column::new("Configuration")]
            .into_iter()
            .chain(columns.into_iter().flatten())
            .collect(),
        rows: numerics
            .iter()
            .map(|row| {
                [Cell::text(row.configuration.name())]
                    .into_iter()
                    .chain(cells(&row.single))
                    .chain(cells(&row.fixed))
                    .collect()
            })
            .collect(),
    }
}
