//! The tables and page of a part program's run.

use quadrant_gcode::Trajectory;
use quadrant_report::{
    Block, Cell, Colour, Column, Figure, Lines, Page, Plot, Provenance, Section, Series, Style,
    Table,
};
use quadrant_sim::metrics::change_percent;

use crate::parts::UM_PER_MM;
use crate::replay::part_program::{ProgramOutcome, ProgramTables};

const AXES: [&str; 3] = ["x", "y", "z"];

/// The share of the path's extent that the magnified contour error may take in its picture.
const DRAWN_SHARE: f64 = 0.08;

/// Contour error and tracking errors of each configuration.
pub fn program_table(outcomes: &[ProgramOutcome]) -> Table {
    let mut columns = vec![
        Column::new("Configuration"),
        Column::with_unit("Contour largest", "um"),
        Column::with_unit("Contour RMS", "um"),
        Column::with_unit("Change of RMS", "%"),
    ];
    for axis in AXES {
        columns.push(Column::with_unit(format!("{axis} largest"), "um"));
        columns.push(Column::with_unit(format!("{axis} RMS"), "um"));
    }
    let rows = outcomes
        .iter()
        .enumerate()
        .map(|(index, outcome)| {
            let um = |mm: f64| Cell::number(mm * UM_PER_MM, 2);
            let change = change_percent(outcomes[0].contour_rms_mm, outcome.contour_rms_mm);
            let mut row = vec![
                Cell::text(outcome.configuration.name()),
                um(outcome.contour_largest_mm),
                um(outcome.contour_rms_mm),
                if index == 0 {
                    Cell::Missing
                } else {
                    Cell::number(change, 1)
                },
            ];
            for (largest, rms) in outcome.axes_mm {
                row.extend([um(largest), um(rms)]);
            }
            row
        })
        .collect();
    Table {
        id: "part-program".to_owned(),
        caption: "Contour error (distance of the true path from the planned one) and tracking error of each axis over the \
                  whole program, simulated; change against the first configuration"
            .to_owned(),
        columns,
        rows,
    }
}

/// Length, duration, and how far the feed was held.
pub fn motion_summary_table(trajectory: &Trajectory, tables: &ProgramTables) -> Table {
    let cutting = |place: &&quadrant_gcode::Place| {
        trajectory.moves()[place.index].feed_mm_s.is_some() && place.speed_mm_s > 0.0
    };
    let places = || tables.places.iter().filter(cutting);
    let at_feed = places()
        .filter(|place| {
            let feed = trajectory.moves()[place.index]
                .feed_mm_s
                .unwrap_or_default();
            place.speed_mm_s >= feed * (1.0 - 1e-6)
        })
        .count();
    let share = 100.0 * at_feed as f64 / places().count().max(1) as f64;
    Table {
        id: "part-program-motion".to_owned(),
        caption: "The program's motion as planned".to_owned(),
        columns: vec![
            Column::with_unit("Moves", "1"),
            Column::with_unit("Path", "mm"),
            Column::with_unit("Duration", "s"),
            Column::with_unit("Cutting time at full feed", "%"),
        ],
        rows: vec![vec![
            Cell::number(trajectory.moves().len() as f64, 0),
            Cell::number(trajectory.length_mm(), 3),
            Cell::number(trajectory.duration_s(), 3),
            Cell::number(share, 1),
        ]],
    }
}

/// The page of a part program on a stage of this name.
pub fn program_page(
    title: &str,
    stage: &str,
    trajectory: &Trajectory,
    tables: &ProgramTables,
    outcomes: &[ProgramOutcome],
    provenance: Provenance,
) -> Page {
    let (picture, magnified) = path_figure(tables, outcomes);
    Page {
        title: format!("Part program {title}"),
        subtitle: format!("On {stage} with the firmware's control law, not measured"),
        provenance,
        sections: vec![Section {
            provenance: None,
            id: "contour".to_owned(),
            heading: "Contour error".to_owned(),
            prose: vec![format!(
                "The contour error is the distance of the true path from the nearest point of the planned one; being late \
                 along the path is no contour error, but is in the axes' tracking errors. In the picture it is magnified \
                 {magnified} times."
            )],
            blocks: vec![
                Block::Table(program_table(outcomes)),
                Block::Table(motion_summary_table(trajectory, tables)),
                Block::Figure(picture),
                Block::Figure(contour_figure(tables, outcomes)),
                Block::Figure(feed_figure(trajectory, tables)),
            ],
        }],
    }
}

/// The two axes that the path extends along most, in their order.
fn widest_axes(tables: &ProgramTables) -> [usize; 2] {
    let extent = |axis: usize| {
        let reference = &tables.reference_mm[axis];
        reference.iter().copied().fold(f64::MIN, f64::max)
            - reference.iter().copied().fold(f64::MAX, f64::min)
    };
    let narrowest = (0..3)
        .min_by(|&one, &other| extent(one).total_cmp(&extent(other)).then(other.cmp(&one)))
        .unwrap_or(2);
    match narrowest {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

/// The largest of 1, 2 and 5 times a power of ten at or below a value; 1 for one below 1.
fn round_factor(value: f64) -> f64 {
    if !(1.0..1e9).contains(&value) {
        return if value < 1.0 { 1.0 } else { 1e9 };
    }
    let decade = 10f64.powf(value.log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|step| step * decade);
    steps
        .into_iter()
        .find(|step| *step <= value)
        .unwrap_or(decade)
}

/// The planned path, and each true one with its contour error magnified by the factor returned.
fn path_figure(tables: &ProgramTables, outcomes: &[ProgramOutcome]) -> (Figure, f64) {
    let [first, second] = widest_axes(tables);
    let [across, up] = [first, second].map(|axis| &tables.reference_mm[axis]);
    let range = |values: &[f64]| {
        values.iter().copied().fold(f64::MIN, f64::max)
            - values.iter().copied().fold(f64::MAX, f64::min)
    };
    let extent_mm = range(across).max(range(up));
    let largest_mm = outcomes
        .iter()
        .map(|outcome| outcome.contour_largest_mm)
        .fold(0.0, f64::max);
    let factor = round_factor(DRAWN_SHARE * extent_mm / largest_mm);
    let mut series = vec![Series {
        name: "planned".to_owned(),
        x: across.clone(),
        y: up.clone(),
        style: Style::solid(Colour::Ink),
    }];
    series.extend(outcomes.iter().enumerate().map(|(index, outcome)| {
        let drawn = |axis: usize| {
            outcome.position_mm[axis]
                .iter()
                .zip(&outcome.deviation_mm)
                .map(|(position, deviation)| position + (factor - 1.0) * deviation[axis])
                .collect()
        };
        Series {
            name: outcome.configuration.name(),
            x: drawn(first),
            y: drawn(second),
            style: Style::nth(index),
        }
    }));
    let figure = Figure {
        id: "part-program-path".to_owned(),
        caption: format!("The path, with the contour error magnified {factor} times, simulated"),
        plot: Plot::Lines(Lines {
            x_label: format!("{} (mm)", AXES[first]),
            y_label: format!("{} (mm)", AXES[second]),
            series,
            equal_units: true,
            ..Lines::default()
        }),
    };
    (figure, factor)
}

fn contour_figure(tables: &ProgramTables, outcomes: &[ProgramOutcome]) -> Figure {
    let series = outcomes
        .iter()
        .enumerate()
        .map(|(index, outcome)| {
            let um = outcome
                .deviation_mm
                .iter()
                .map(|[x, y, z]| UM_PER_MM * x.hypot(*y).hypot(*z));
            Series {
                name: outcome.configuration.name(),
                x: (0..outcome.deviation_mm.len())
                    .map(|tick| tick as f64 * tables.period_s)
                    .collect(),
                y: um.collect(),
                style: Style::nth(index),
            }
        })
        .collect();
    Figure {
        id: "part-program-contour".to_owned(),
        caption: "Contour error over time, simulated".to_owned(),
        plot: Plot::Lines(Lines {
            x_label: "time (s)".to_owned(),
            y_label: "contour error (um)".to_owned(),
            series,
            ..Lines::default()
        }),
    }
}

fn feed_figure(trajectory: &Trajectory, tables: &ProgramTables) -> Figure {
    let mut starts_mm = vec![0.0];
    for step in trajectory.moves() {
        let end = starts_mm.last().copied().unwrap_or_default() + step.segment.length_mm();
        starts_mm.push(end);
    }
    Figure {
        id: "part-program-feed".to_owned(),
        caption: "Speed along the path, as planned".to_owned(),
        plot: Plot::Lines(Lines {
            x_label: "path (mm)".to_owned(),
            y_label: "speed (mm/min)".to_owned(),
            series: vec![Series {
                name: "planned".to_owned(),
                x: tables
                    .places
                    .iter()
                    .map(|place| starts_mm[place.index] + place.along_mm)
                    .collect(),
                y: tables
                    .places
                    .iter()
                    .map(|place| 60.0 * place.speed_mm_s)
                    .collect(),
                style: Style::nth(0),
            }],
            ..Lines::default()
        }),
    }
}
