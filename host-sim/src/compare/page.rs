//! The comparison's tables and page.

use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;

use crate::circle::CircleOutcome;
use crate::circle::single_page::{circle_figures, circle_table};
use crate::compare::headlines::HEADLINES;
use crate::compare::sine::{AMPLITUDE_MM, Outcome, VELOCITIES_MM_S, find, mean_change_percent};
use crate::experiment::configuration::Configuration;
use crate::experiment::metrics::{GLITCH_WINDOW, Score};
use crate::experiment::run_configuration::Knowledge;
use crate::pages::{UM_PER_MM, error_curve};
use crate::report::{
    Block, Cell, Column, Figure, Lines, Page, Plot, Provenance, Section, Style, Table,
};

/// Control period of the outcomes' traces, s.
const PERIOD_S: f64 = 1e-4;

/// A score's name, what it is, and how it is read.
struct Reading {
    id: &'static str,
    caption: &'static str,
    read: fn(&Score) -> f64,
}

const READINGS: [Reading; 3] = [
    Reading {
        id: "tracking-error-largest",
        caption: "Tracking error, largest magnitude over two cycles",
        read: |score| score.largest_mm,
    },
    Reading {
        id: "tracking-error-rms",
        caption: "Tracking error, RMS over two cycles",
        read: |score| score.rms_mm,
    },
    Reading {
        id: "quadrant-glitch",
        caption: "Quadrant glitch, mean over the reversals of two cycles",
        read: |score| score.glitch_mm,
    },
];

/// PID without feedforward: what all changes are counted from.
const BASELINE: Configuration = Configuration {
    controller: LawKind::Pid,
    feedforward: FeedforwardKind::None,
};

/// The comparison's tables: one for each score, the headlines, the circles.
pub fn comparison_tables(outcomes: &[Outcome], circles: &[CircleOutcome]) -> Vec<Table> {
    READINGS
        .iter()
        .map(|reading| score_table(reading, outcomes))
        .chain([headline_table(outcomes), circle_table(circles)])
        .collect()
}

/// A name that fits a column's head.
fn short(knowledge: Knowledge) -> &'static str {
    match knowledge {
        Knowledge::Matched => "matched",
        Knowledge::VirtualMachine => "virtual",
    }
}

fn score_table(reading: &Reading, outcomes: &[Outcome]) -> Table {
    let mut columns = vec![Column::new("Configuration")];
    for knowledge in Knowledge::ALL {
        for velocity in VELOCITIES_MM_S {
            let heading = format!("{} {velocity} mm/s", short(knowledge));
            columns.push(Column::with_unit(heading, "um"));
        }
        let heading = format!("{} mean change", short(knowledge));
        columns.push(Column::with_unit(heading, "%"));
    }
    let value = |configuration, knowledge, velocity| {
        find(outcomes, configuration, knowledge, velocity)
            .map(|outcome| (reading.read)(&outcome.score) * UM_PER_MM)
    };
    let rows = Configuration::all()
        .into_iter()
        .map(|configuration| {
            let mut row = vec![Cell::text(configuration.name())];
            for knowledge in Knowledge::ALL {
                let mut changes = Vec::new();
                for velocity in VELOCITIES_MM_S {
                    let own = value(configuration, knowledge, velocity);
                    let baseline = value(BASELINE, knowledge, velocity);
                    row.push(own.map_or(Cell::Missing, |um| Cell::number(um, 2)));
                    changes.extend(
                        own.zip(baseline)
                            .map(|(own, from)| (own / from - 1.0) * 100.0),
                    );
                }
                row.push(if configuration == BASELINE || changes.is_empty() {
                    Cell::Missing
                } else {
                    Cell::number(changes.iter().sum::<f64>() / changes.len() as f64, 1)
                });
            }
            row
        })
        .collect();
    Table {
        id: reading.id.to_owned(),
        caption: format!("{}; change against PID alone", reading.caption),
        columns,
        rows,
    }
}

fn headline_table(outcomes: &[Outcome]) -> Table {
    let rows = HEADLINES
        .iter()
        .map(|headline| {
            let ours = |knowledge| {
                let (from, to) = (headline.from, headline.to);
                mean_change_percent(outcomes, knowledge, headline.metric, from, to)
                    .map_or(Cell::Missing, |change| Cell::number(change, 1))
            };
            vec![
                Cell::text(headline.comparison),
                Cell::text(headline.metric.name()),
                Cell::number(headline.change_percent, 1),
                ours(Knowledge::Matched),
                ours(Knowledge::VirtualMachine),
            ]
        })
        .collect();
    Table {
        id: "headlines".to_owned(),
        caption: "The thesis' headline changes beside ours. The thesis measured its own stage; ours are simulated on \
                  ours, mean over the three velocities, tracking error as largest magnitude. Nothing was tuned to \
                  meet them"
            .to_owned(),
        columns: vec![
            Column::new("Comparison"),
            Column::new("Metric"),
            Column::with_unit("Thesis", "%"),
            Column::with_unit("Ours, matched", "%"),
            Column::with_unit("Ours, virtual machine", "%"),
        ],
        rows,
    }
}

pub fn comparison_page(
    outcomes: &[Outcome],
    circles: &[CircleOutcome],
    provenance: Provenance,
) -> Page {
    let mut tables = comparison_tables(outcomes, circles).into_iter();
    let mut next_tables = |count| {
        tables
            .by_ref()
            .take(count)
            .map(Block::Table)
            .collect::<Vec<_>>()
    };
    let scores = next_tables(READINGS.len());
    let headlines = next_tables(1);
    let circle_tables = next_tables(1);
    let errors = |knowledge: Knowledge| {
        VELOCITIES_MM_S
            .iter()
            .map(|&velocity| Block::Figure(error_figure(outcomes, knowledge, velocity)))
            .collect::<Vec<_>>()
    };
    Page {
        title: "Friction compensation on the simulated stage".to_owned(),
        subtitle: "PID and N-PID, each with no, static, GMS and combined feedforward; simulated, not measured"
            .to_owned(),
        provenance,
        sections: vec![
            Section {
                provenance: None,
                id: "summary".to_owned(),
                heading: "The thesis' headlines".to_owned(),
                prose: vec![experiment_prose()],
                blocks: headlines,
            },
            Section {
                provenance: None,
                id: "scores".to_owned(),
                heading: "Tracking error and quadrant glitch".to_owned(),
                prose: vec![metric_prose(), knowledge_prose()],
                blocks: scores,
            },
            Section {
                provenance: None,
                id: "matched".to_owned(),
                heading: "Error over time, matched".to_owned(),
                prose: vec![],
                blocks: errors(Knowledge::Matched),
            },
            Section {
                provenance: None,
                id: "virtual-machine".to_owned(),
                heading: "Error over time, virtual machine".to_owned(),
                prose: vec![],
                blocks: errors(Knowledge::VirtualMachine),
            },
            Section {
                provenance: None,
                id: "circle".to_owned(),
                heading: "Circle in XY".to_owned(),
                prose: vec![],
                blocks: circle_tables
                    .into_iter()
                    .chain(circle_figures(circles).into_iter().map(Block::Figure))
                    .collect(),
            },
        ],
    }
}

fn experiment_prose() -> String {
    format!(
        "The x axis follows a sine of {AMPLITUDE_MM} mm amplitude whose largest velocity is 5, 10 or 15 mm/s. The \
         control law is the firmware's, in f32, at 10 kHz; the stage is simulated. PID gains have the thesis' gain and \
         phase margins on the axis' linear model; neither gains nor plant were tuned to the thesis' percentages."
    )
}

fn metric_prose() -> String {
    format!(
        "Tracking error is the reference minus the true position. The glitch of a reversal is the largest error \
         magnitude within {window} % of the cycle on either side of it, over the mean error magnitude in the shoulders of \
         the same width next to that window.",
        window = GLITCH_WINDOW * 100.0
    )
}

fn knowledge_prose() -> String {
    "Matched: the compensator has the plant's own friction parameters, and the plant no imperfections but quantisation. \
     Virtual machine: the plant adds encoder noise, offset and ripple, and everything that the law knows of it, gains \
     included, is what commissioning the simulated axes found, with the eight GMS elements that the firmware has room for."
        .to_owned()
}

fn error_figure(outcomes: &[Outcome], knowledge: Knowledge, velocity_mm_s: f64) -> Figure {
    let series = Configuration::all()
        .into_iter()
        .enumerate()
        .filter_map(|(index, configuration)| {
            let outcome = find(outcomes, configuration, knowledge, velocity_mm_s)?;
            let error = &outcome.last_cycle.error_mm;
            Some(error_curve(
                configuration.name(),
                error,
                PERIOD_S,
                Style::nth(index),
            ))
        })
        .collect();
    Figure {
        id: format!(
            "error-{}-{velocity_mm_s}",
            knowledge.name().replace(' ', "-")
        ),
        caption: format!(
            "Tracking error over the last cycle at {velocity_mm_s} mm/s, {}",
            knowledge.name()
        ),
        plot: Plot::Lines(Lines {
            x_label: "time (s)".to_owned(),
            y_label: "tracking error (um)".to_owned(),
            series,
            ..Lines::default()
        }),
    }
}
