//! The circle tests' tables, sections and page.

use quadrant_report::{Block, Cell, Column, Page, Provenance, Section, Table};
use quadrant_sim::metrics::change_percent;

use crate::circle::cases::{
    Circle, circles, configurations, deviation_mm, plane_name, planes, same_circle, sense_name,
};
use crate::circle::figures::{feed_figures, polar_figures};
use crate::circle::request::{CircleCase, CircleResult, CircleTest};

/// The tables: the summary, every circle, its reversals, and the circles that were not run if there are any.
pub fn circle_tables(results: &[CircleResult]) -> Vec<Table> {
    let circles = circles(results);
    let mut tables = vec![
        summary_table(&circles),
        circle_table(&circles),
        reversal_table(&circles),
    ];
    let refused = refusal_table(results);
    if !refused.rows.is_empty() {
        tables.push(refused);
    }
    tables
}

fn case_columns() -> Vec<Column> {
    vec![
        Column::new("Plane"),
        Column::with_unit("Radius", "mm"),
        Column::with_unit("Feed", "mm/min"),
        Column::new("Configuration"),
    ]
}

fn case_cells(case: &CircleCase) -> Vec<Cell> {
    vec![
        Cell::text(plane_name(case.plane)),
        Cell::number(case.radius_mm, 1),
        Cell::number(
            case.feed_mm_min,
            if case.feed_mm_min < 10.0 { 2 } else { 0 },
        ),
        Cell::text(case.configuration.name()),
    ]
}

fn summary_table(circles: &[Circle<'_>]) -> Table {
    let configurations = configurations(circles);
    let mut rows = Vec::new();
    for plane in planes(circles) {
        let mut baseline: Option<[f64; 2]> = None;
        for &configuration in &configurations {
            let own: Vec<_> = circles
                .iter()
                .filter(|c| c.case.plane == plane && c.case.configuration == configuration)
                .collect();
            if own.is_empty() {
                continue;
            }
            let values = |length: fn(&CircleTest) -> f64| {
                let values: Vec<f64> = own.iter().map(|circle| circle.mean_um(length)).collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                (mean, values.into_iter().fold(0.0, f64::max))
            };
            let (deviation, worst_deviation) = values(deviation_mm);
            let (spike, _) = values(CircleTest::mean_spike_mm);
            let (_, worst_spike) = values(CircleTest::largest_spike_mm);
            let changes = baseline.map(|[from_deviation, from_spike]| {
                [
                    change_percent(from_deviation, deviation),
                    change_percent(from_spike, spike),
                ]
            });
            let change = |index: usize| {
                changes.map_or(Cell::Missing, |changes| Cell::number(changes[index], 1))
            };
            rows.push(vec![
                Cell::text(plane_name(plane)),
                Cell::text(configuration.name()),
                Cell::number(own.len() as f64, 0),
                Cell::number(deviation, 2),
                Cell::number(worst_deviation, 2),
                change(0),
                Cell::number(spike, 2),
                Cell::number(worst_spike, 2),
                change(1),
            ]);
            baseline = baseline.or(Some([deviation, spike]));
        }
    }
    Table {
        id: "circle-summary".to_owned(),
        caption: "Bi-directional circular deviation G(b) and reversal spikes over all radii and feeds, simulated: mean \
                  and largest, and the change of the mean against the first configuration"
            .to_owned(),
        columns: vec![
            Column::new("Plane"),
            Column::new("Configuration"),
            Column::with_unit("Circles", "1"),
            Column::with_unit("G(b) mean", "um"),
            Column::with_unit("G(b) largest", "um"),
            Column::with_unit("Change", "%"),
            Column::with_unit("Spike mean", "um"),
            Column::with_unit("Spike largest", "um"),
            Column::with_unit("Change", "%"),
        ],
        rows,
    }
}

type Reading = (&'static str, fn(&CircleTest) -> f64);

const READINGS: [Reading; 9] = [
    ("G(CW)", |test| test.clockwise.circular_deviation_mm),
    ("G(CCW)", |test| {
        test.counter_clockwise.circular_deviation_mm
    }),
    ("G(b)", deviation_mm),
    ("H", |test| test.both.hysteresis_mm),
    ("Fmax", |test| {
        let [one, other] = test.turns().map(|(_, turn)| turn.radial_max_mm);
        one.max(other)
    }),
    ("Fmin", |test| {
        let [one, other] = test.turns().map(|(_, turn)| turn.radial_min_mm);
        one.min(other)
    }),
    ("D", |test| test.both.mean_radial_mm),
    ("Spike mean", CircleTest::mean_spike_mm),
    ("Spike largest", CircleTest::largest_spike_mm),
];

/// The readings whose spread over the seeds is shown.
const SPREAD: [Reading; 2] = [
    ("G(b) spread", deviation_mm),
    ("Spike spread", CircleTest::mean_spike_mm),
];

fn circle_table(circles: &[Circle<'_>]) -> Table {
    let seeds = circles.iter().map(|c| c.tests.len()).max().unwrap_or(0);
    let spread: &[Reading] = if seeds > 1 { &SPREAD } else { &[] };
    let mut columns = case_columns();
    let readings = READINGS.iter().chain(spread);
    columns.extend(readings.map(|(name, _)| Column::with_unit(*name, "um")));
    let rows = circles
        .iter()
        .map(|circle| {
            let mut row = case_cells(&circle.case);
            row.extend(READINGS.map(|(_, read)| Cell::number(circle.mean_um(read), 2)));
            row.extend(
                spread
                    .iter()
                    .map(|(_, read)| Cell::number(circle.spread_um(read), 2)),
            );
            row
        })
        .collect();
    let over_seeds = if seeds > 1 {
        format!("; mean over {seeds} seeds, and largest less smallest over them")
    } else {
        String::new()
    };
    Table {
        id: "circle-tests".to_owned(),
        caption: format!(
            "Circle tests after ISO 230-4, simulated: circular deviation G for each sense and G(b) for both, hysteresis H, \
             extremes of the radial deviation F over both senses, mean radial deviation D, height of the reversal \
             spikes{over_seeds}"
        ),
        columns,
        rows,
    }
}

fn reversal_table(circles: &[Circle<'_>]) -> Table {
    let mut columns = case_columns();
    columns.push(Column::new("Sense"));
    let angles = ["0 deg", "90 deg", "180 deg", "270 deg"];
    columns.extend(angles.map(|angle| Column::with_unit(angle, "um")));
    let rows = circles
        .iter()
        .flat_map(|circle| {
            [0, 1].map(|sense| {
                let mut row = case_cells(&circle.case);
                let name = circle.tests[0].turns()[sense].0;
                row.push(Cell::text(sense_name(name)));
                row.extend((0..4).map(|at| {
                    let spike = circle.mean_um(|test| test.turns()[sense].1.spikes.0[at]);
                    Cell::number(spike, 2)
                }));
                row
            })
        })
        .collect();
    Table {
        id: "circle-reversals".to_owned(),
        caption: "The spike at each reversal, outwards positive, simulated. The plane's first axis reverses at 0 and 180 \
                  degrees, its second at 90 and 270"
            .to_owned(),
        columns,
        rows,
    }
}

fn refusal_table(results: &[CircleResult]) -> Table {
    let mut columns = case_columns();
    columns.push(Column::new("Reason"));
    Table {
        id: "circle-refusals".to_owned(),
        caption: "Circles that were not run to their end".to_owned(),
        columns,
        rows: results
            .chunk_by(same_circle)
            .filter_map(|runs| {
                let refusal = runs.iter().find_map(|run| run.outcome.as_ref().err())?;
                let mut row = case_cells(&runs[0].case);
                row.push(Cell::text(refusal.to_string()));
                Some(row)
            })
            .collect(),
    }
}

/// The sections of a report: results, figures, every circle.
pub fn circle_sections(results: &[CircleResult], stage: &str) -> Vec<Section> {
    let circles = circles(results);
    let mut tables = circle_tables(results).into_iter().map(Block::Table);
    let mut summary: Vec<Block> = tables.by_ref().take(1).collect();
    summary.extend(feed_figures(&circles).into_iter().map(Block::Figure));
    vec![
        Section {
            provenance: None,
            id: "circle-summary-section".to_owned(),
            heading: "Circle tests".to_owned(),
            prose: vec![method_prose(stage)],
            blocks: summary,
        },
        Section {
            provenance: None,
            id: "circle-polar-section".to_owned(),
            heading: "Paths".to_owned(),
            prose: vec![],
            blocks: polar_figures(&circles)
                .into_iter()
                .map(Block::Figure)
                .collect(),
        },
        Section {
            provenance: None,
            id: "circle-tests-section".to_owned(),
            heading: "Every circle".to_owned(),
            prose: vec![definition_prose()],
            blocks: tables.collect(),
        },
    ]
}

fn method_prose(stage: &str) -> String {
    format!(
        "Two axes follow each circle together, clockwise and counter-clockwise, at 10 kHz on the firmware's control law in \
     f32. Two turns are run at the full feed between a smooth lead-in and lead-out, and the middle 360 degrees count. The \
     path is the true one of {stage}, so that neither encoder noise nor quantisation is in it."
    )
}

fn definition_prose() -> String {
    "G is the radial range of the path about the centre of its least-squares circle; G(b) that of both senses about one \
     centre; H the largest radial distance between the senses at one angle; F the distance from the nominal centre less \
     the nominal radius; D the radius of the least-squares circle of both senses less the nominal one. A spike is the \
     radial deviation about a reversal that is farthest from the mean deviation just before it."
        .to_owned()
}

/// The page of the circle tests on a stage of this name.
pub fn circle_page(results: &[CircleResult], stage: &str, provenance: Provenance) -> Page {
    Page {
        title: "Circle tests".to_owned(),
        subtitle: format!("ISO 230-4 on {stage}, not measured"),
        provenance,
        sections: circle_sections(results, stage),
    }
}
