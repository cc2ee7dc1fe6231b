//! The table and figures of the comparison's circle.

use quadrant_report::{
    Cell, Column, DeviationTrace, Figure, Lines, Plot, PolarDeviation, Series, Style, Table,
};

use crate::circle::{CircleOutcome, FEED_MM_S, RADIUS_MM};
use crate::experiment::configuration::Configuration;
use crate::parts::UM_PER_MM;

/// Circular deviation and reversal spikes.
pub fn circle_table(circles: &[CircleOutcome]) -> Table {
    Table {
        id: "circle-test".to_owned(),
        caption: format!(
            "Circle of {RADIUS_MM} mm radius at {FEED_MM_S} mm/s in XY, counter-clockwise, friction identified from experiments: circular \
             deviation G (radial range about the least-squares centre, ISO 230-4), and mean radial height of the \
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

/// A path's deviation, mm, over its angle, rad, as a curve in um over degrees from 0 to 360.
fn over_angle(name: String, path: &[(f64, f64)], style: Style) -> Series {
    let mut points: Vec<(f64, f64)> = path
        .iter()
        .map(|&(angle, deviation)| (angle.to_degrees().rem_euclid(360.0), deviation * UM_PER_MM))
        .collect();
    points.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let (x, y) = points.into_iter().unzip();
    Series { name, x, y, style }
}

/// Some of the circles as a ball-bar draws them, in the styles that they have among all.
pub fn polar_figure(
    id: &str,
    circles: &[CircleOutcome],
    shown: impl Fn(Configuration) -> bool,
) -> Figure {
    let traces = circles
        .iter()
        .enumerate()
        .filter(|(_, circle)| shown(circle.configuration))
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
    Figure {
        id: id.to_owned(),
        caption: "Radial deviation, magnified, around the nominal circle".to_owned(),
        plot: Plot::PolarDeviation(PolarDeviation {
            radius_mm: RADIUS_MM,
            x_label: "x (mm)".to_owned(),
            y_label: "y (mm)".to_owned(),
            traces,
        }),
    }
}

/// The circle as a ball-bar draws it, and the same deviation over the angle.
pub fn circle_figures(circles: &[CircleOutcome]) -> Vec<Figure> {
    let over_angle = circles
        .iter()
        .enumerate()
        .map(|(index, circle)| {
            let name = circle.configuration.name();
            over_angle(name, &circle.path, Style::nth(index))
        })
        .collect();
    vec![
        polar_figure("circle-polar", circles, |_| true),
        Figure {
            id: "circle-deviation".to_owned(),
            caption: "The same radial deviation over the angle".to_owned(),
            plot: Plot::Lines(Lines {
                x_label: "angle (deg)".to_owned(),
                y_label: "radial deviation (um)".to_owned(),
                series: over_angle,
                ..Lines::default()
            }),
        },
    ]
}
