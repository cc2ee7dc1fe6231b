//! The nominal characteristic trajectory: what was measured, and what control follows of it.

use quadrant_law::control::nctf::CharacteristicPoint;
use quadrant_report::{Block, Cell, Colour, Plot, Scale, Section, Style, Table};
use quadrant_tune::identify::characteristic::Characteristic;

use crate::parts::{columns, lines, series};

/// The points that control follows.
pub fn characteristic_table(points: &[CharacteristicPoint]) -> Table {
    Table {
        id: "characteristic".to_owned(),
        caption: "Nominal characteristic trajectory for control: feedback.nctf.characteristic of the settings".to_owned(),
        columns: columns(&[("Error", "mm"), ("Velocity", "mm/s")]),
        rows: points
            .iter()
            .map(|point| {
                vec![
                    Cell::number(point.error_mm, 4),
                    Cell::number(point.velocity_mm_s, 2),
                ]
            })
            .collect(),
    }
}

/// The measured trajectory, the line of the slope given (1/s), and the points that control follows.
pub fn characteristic_section(
    found: &Characteristic,
    slope_per_s: f64,
    points: &[CharacteristicPoint],
) -> Section {
    let (x, y): (Vec<f64>, Vec<f64>) = found.trajectory.iter().copied().unzip();
    let straight = x.iter().map(|distance| slope_per_s * distance).collect();
    let curves = vec![
        series("measured", x.clone(), y, Style::points(Colour::Blue)),
        series(
            "slope of the PID",
            x,
            straight,
            Style::dashed(Colour::Vermillion),
        ),
        series(
            "followed",
            points.iter().map(|point| point.error_mm).collect(),
            points.iter().map(|point| point.velocity_mm_s).collect(),
            Style::solid(Colour::Green),
        ),
    ];
    let mut figure = lines(
        "trajectory",
        "Speed of the coasting axis over the distance to its place of rest",
        ("distance (mm)", "speed (mm/s)"),
        curves,
    );
    if let Plot::Lines(plot) = &mut figure.plot {
        (plot.x_scale, plot.y_scale) = (Scale::Logarithmic, Scale::Logarithmic);
    }
    let knee = found.knee_mm(slope_per_s).map_or_else(
        || {
            "Within the measured distance it lies above the line whose slope the loop's robustness allows: friction brakes the axis \
             harder than control may, and NCTF is a PID there."
                .to_owned()
        },
        |knee| {
            format!(
                "It lies above the line whose slope the loop's robustness allows up to {knee:.3} mm: there NCTF is a PID; beyond, it \
                 follows the trajectory."
            )
        },
    );
    Section {
        provenance: None,
        id: "characteristic-trajectory".to_owned(),
        heading: "Nominal characteristic trajectory".to_owned(),
        prose: vec![
            format!(
                "The axis was driven with {:.2} V and left alone, both ways. The trajectory is the mean of the passes, which scatter by \
                 {:.1} % (RMS).",
                found.voltage_v,
                100.0 * found.scatter
            ),
            knee,
        ],
        blocks: vec![
            Block::Table(characteristic_table(points)),
            Block::Figure(figure),
        ],
    }
}
