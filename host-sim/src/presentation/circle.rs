//! The circle test's table and figures.

use super::{UM_PER_MM, error_curve};
use crate::experiment::circle::{CircleOutcome, FEED_MM_S, RADIUS_MM};
use crate::report::{
    Cell, Column, DeviationTrace, Figure, Lines, Plot, PolarDeviation, Style, Table,
};

/// Circular deviation and reversal spikes.
pub(super) fn circle_table(circles: &[CircleOutcome]) -> Table {
    Table {
        id: "circle-test".to_owned(),
        caption: format!(
            "Circle of {RADIUS_MM} mm radius at {FEED_MM_S} mm/s in XY, counter-clockwise, virtual machine: circular \
             deviation G (largest minus smallest radial deviation, as in ISO 230-4), and mean radial height of the \
             spikes at the four reversals"
        ),
        columns: vec![
            Column::new("Configuration"),
            Column::with_unit("Circular deviation G", "um"),
            Column::with_unit("Reversal spike", "um"),
        ],
        rows: circles
            .iter()
            .map(|circle| {
                vec![
                    Cell::text(circle.configuration.name()),
                    Cell::number(circle.circular_deviation_mm * UM_PER_MM, 2),
                    Cell::number(circle.reversal_spike_mm * UM_PER_MM, 2),
                ]
            })
            .collect(),
    }
}

/// The circle as a ball-bar draws it, and the same deviation over the angle.
pub(super) fn circle_figures(circles: &[CircleOutcome]) -> Vec<Figure> {
    let traces = circles
        .iter()
        .enumerate()
        .map(|(index, circle)| DeviationTrace {
            name: circle.configuration.name(),
            angle_rad: circle.path.iter().map(|&(angle, _)| angle).collect(),
            deviation_um: circle
                .path
                .iter()
                .map(|&(_, deviation)| deviation * UM_PER_MM)
                .collect(),
            style: Style::nth(index),
        })
        .collect();
    let over_time = circles
        .iter()
        .enumerate()
        .map(|(index, circle)| {
            let deviations: Vec<f64> = circle
                .path
                .iter()
                .map(|&(_, deviation)| deviation)
                .collect();
            let turn = 1.0 / deviations.len() as f64;
            error_curve(
                circle.configuration.name(),
                &deviations,
                turn,
                Style::nth(index),
            )
        })
        .collect();
    vec![
        Figure {
            id: "circle-polar".to_owned(),
            caption: "Radial deviation, magnified, around the nominal circle".to_owned(),
            plot: Plot::PolarDeviation(PolarDeviation {
                radius_mm: RADIUS_MM,
                x_label: "x (mm)".to_owned(),
                y_label: "y (mm)".to_owned(),
                traces,
            }),
        },
        Figure {
            id: "circle-deviation".to_owned(),
            caption: "The same radial deviation over the turn, from 45 degrees".to_owned(),
            plot: Plot::Lines(Lines {
                x_label: "turn (1)".to_owned(),
                y_label: "radial deviation (um)".to_owned(),
                series: over_time,
                ..Lines::default()
            }),
        },
    ]
}
