//! The table of an identification judged by the truth.

use quadrant_pages::parts::columns;
use quadrant_report::{Cell, Table};

use crate::identification::{Estimate, Judged, Judgement};

/// Errors and honesty by parameter, over all runs.
pub fn validation_table(judgements: &[Judgement]) -> Table {
    let rows = Judged::ALL
        .into_iter()
        .map(|judged| {
            let estimates: Vec<&Estimate> = judgements
                .iter()
                .flat_map(|judgement| &judgement.estimates)
                .filter(|estimate| estimate.judged == judged)
                .collect();
            let count = estimates.len() as f64;
            let worst = estimates.iter().fold(0.0_f64, |worst, estimate| {
                worst.max(estimate.error_percent().abs())
            });
            let square: f64 = estimates
                .iter()
                .map(|estimate| estimate.error_percent().powi(2))
                .sum();
            let stated: f64 = estimates
                .iter()
                .map(|estimate| 100.0 * estimate.standard_error / estimate.truth.abs())
                .sum();
            let honest = estimates
                .iter()
                .filter(|estimate| estimate.is_honest())
                .count();
            vec![
                Cell::text(judged.name()),
                Cell::number(count, 0),
                Cell::number(worst, 4),
                Cell::number((square / count).sqrt(), 4),
                Cell::number(stated / count, 4),
                Cell::number(judged.limit_percent(), 0),
                Cell::number(100.0 * honest as f64 / count, 1),
            ]
        })
        .chain(std::iter::once({
            let count = judgements.len() as f64;
            let worst = judgements
                .iter()
                .map(|j| j.hysteresis_percent)
                .fold(0.0, f64::max);
            let square: f64 = judgements
                .iter()
                .map(|j| j.hysteresis_percent.powi(2))
                .sum();
            vec![
                Cell::text("hysteresis, of Fs"),
                Cell::number(count, 0),
                Cell::number(worst, 4),
                Cell::number((square / count).sqrt(), 4),
                Cell::Missing,
                Cell::number(3.0, 0),
                Cell::Missing,
            ]
        }))
        .collect();
    Table {
        id: "identification".to_owned(),
        caption: "Identification of the simulated stage against the truth that was hidden from it: x, y and z axes, encoder noise of 0.5, 1 \
                  and 2 times the stage's"
            .to_owned(),
        columns: columns(&[
            ("Quantity", ""),
            ("Estimates", ""),
            ("Worst error", "%"),
            ("RMS error", "%"),
            ("Stated deviation, mean", "%"),
            ("Allowed", "%"),
            ("Truth within 2 deviations", "%"),
        ]),
        rows,
    }
}
