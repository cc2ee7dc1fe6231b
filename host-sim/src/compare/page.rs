//! The comparison's tables and page.

use crate::circle::CircleOutcome;
use crate::circle::single_page::{circle_figures, circle_table, polar_figure};
use crate::compare::comparison::Comparison;
use crate::compare::glance::Glance;
use crate::compare::headlines::{HEADLINE_PROSE, headline_table};
use crate::compare::reversal::Reversal;
use crate::compare::sine::{AMPLITUDE_MM, VELOCITIES_MM_S};
use crate::design::best::{COMPLEMENTARY_PEAK, SENSITIVITY_PEAK};
use crate::experiment::configuration::Configuration;
use crate::experiment::metrics::{GLITCH_WINDOW, Metric, change_percent};
use crate::experiment::run_configuration::ModelKnowledge;
use crate::pages::{UM_PER_MM, lines, series};
use crate::report::{Block, Cell, Column, Figure, Page, Provenance, Section, Style, Table};

/// Names of the tables of [`Metric::ALL`].
const IDS: [&str; 3] = [
    "tracking-error-largest",
    "tracking-error-rms",
    "quadrant-glitch",
];

/// The comparison's tables: one for each score, the headlines, the circles.
pub fn comparison_tables(comparison: &Comparison, circles: &[CircleOutcome]) -> Vec<Table> {
    IDS.into_iter()
        .zip(Metric::ALL)
        .map(|(id, metric)| score_table(id, metric, comparison))
        .chain([headline_table(comparison), circle_table(circles)])
        .collect()
}

fn score_table(id: &str, metric: Metric, comparison: &Comparison) -> Table {
    let value = |configuration, knowledge, velocity| {
        comparison
            .find(configuration, knowledge, AMPLITUDE_MM, velocity)
            .map(|entry| entry.statistic(metric.read).mean * UM_PER_MM)
    };
    let rows = Configuration::with_best_pid()
        .into_iter()
        .map(|configuration| {
            let mut row = vec![Cell::text(configuration.name())];
            for knowledge in ModelKnowledge::ALL {
                let mut changes = Vec::new();
                for velocity in VELOCITIES_MM_S {
                    let own = value(configuration, knowledge, velocity);
                    let baseline = value(Configuration::BEST_PID, knowledge, velocity);
                    row.push(own.map_or(Cell::Missing, |um| Cell::number(um, 2)));
                    let pair = baseline.zip(own);
                    changes.extend(pair.map(|(from, own)| change_percent(from, own)));
                }
                row.push(
                    if configuration == Configuration::BEST_PID || changes.is_empty() {
                        Cell::Missing
                    } else {
                        Cell::number(changes.iter().sum::<f64>() / changes.len() as f64, 1)
                    },
                );
            }
            row
        })
        .collect();
    Table {
        id: id.to_owned(),
        caption: format!(
            "{} over two cycles; change against the best PID",
            metric.title
        ),
        columns: score_columns(),
        rows,
    }
}

/// Heads of the errors with each knowledge at each velocity, and of their mean change, beside the configurations.
fn score_columns() -> Vec<Column> {
    let mut columns = vec![Column::new("Configuration")];
    for knowledge in ModelKnowledge::ALL {
        for velocity in VELOCITIES_MM_S {
            let heading = format!("{}, {velocity} mm/s", knowledge.short());
            columns.push(Column::with_unit(heading, "um"));
        }
        let heading = format!("{}, mean change", knowledge.short());
        columns.push(Column::with_unit(heading, "%"));
    }
    columns
}

/// The comparison's page.
pub fn comparison_page(
    comparison: &Comparison,
    glance: &Glance,
    circles: &[CircleOutcome],
    provenance: Provenance,
) -> Page {
    let mut tables = comparison_tables(comparison, circles).into_iter();
    let mut next_tables = |count| {
        tables
            .by_ref()
            .take(count)
            .map(Block::Table)
            .collect::<Vec<_>>()
    };
    let scores = next_tables(IDS.len());
    let headlines = next_tables(1);
    let circle_tables = next_tables(1);
    let errors = |knowledge: ModelKnowledge| {
        VELOCITIES_MM_S
            .iter()
            .map(|&velocity| {
                let configurations = Configuration::with_best_pid();
                let id = format!("error-{}-{velocity}", knowledge.name().replace(' ', "-"));
                let figure = reversal_figure(id, comparison, &configurations, knowledge, velocity);
                Block::Figure(figure)
            })
            .collect::<Vec<_>>()
    };
    let first_reversal = reversal_figure(
        "reversal".to_owned(),
        comparison,
        &SHOWN,
        ModelKnowledge::Identified,
        VELOCITIES_MM_S[0],
    );
    Page {
        title: "Friction compensation on the simulated stage".to_owned(),
        subtitle: "The best PID with and without feedforward of friction, and the thesis' PID and N-PID, each with no, static, GMS \
                   and combined feedforward; simulated, not measured"
            .to_owned(),
        provenance,
        sections: vec![
            Section {
                provenance: None,
                id: "glance".to_owned(),
                heading: "At a glance".to_owned(),
                prose: vec![glance.sentence.clone(), glance_prose(circles), best_pid_prose()],
                blocks: vec![
                    Block::Table(glance.table.clone()),
                    Block::Figure(polar_figure("circle-glance", circles, |configuration| {
                        SHOWN.contains(&configuration)
                    })),
                    Block::Figure(first_reversal),
                ],
            },
            Section {
                provenance: None,
                id: "summary".to_owned(),
                heading: "The thesis' headlines".to_owned(),
                prose: vec![HEADLINE_PROSE.to_owned(), experiment_prose()],
                blocks: headlines,
            },
            Section {
                provenance: None,
                id: "scores".to_owned(),
                heading: "Tracking error and quadrant glitch".to_owned(),
                prose: vec![metric_prose()],
                blocks: scores,
            },
            Section {
                provenance: None,
                id: "exact-model".to_owned(),
                heading: "A reversal, friction known exactly".to_owned(),
                prose: vec![],
                blocks: errors(ModelKnowledge::Exact),
            },
            Section {
                provenance: None,
                id: "identified-model".to_owned(),
                heading: "A reversal, friction identified from experiments".to_owned(),
                prose: vec![],
                blocks: errors(ModelKnowledge::Identified),
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

/// The laws whose circle and reversal are shown at first.
const SHOWN: [Configuration; 2] = [Configuration::BEST_PID, Configuration::BEST_PID_FED];

fn glance_prose(circles: &[CircleOutcome]) -> String {
    let deviation_um = |configuration| {
        let found = circles
            .iter()
            .find(|circle| circle.configuration == configuration);
        found.map_or(f64::NAN, |circle| circle.circular_deviation_mm * UM_PER_MM)
    };
    let [alone, fed] = SHOWN;
    format!(
        "A circle of the simulated XY stage, and one reversal of its x axis at {velocity} mm/s. Where an axis reverses, friction \
         holds it, and the error rises until it breaks away: the quadrant glitch. Feedforward puts the friction's voltage out \
         before it is missed. Circular deviation: {alone_um:.1} um with the {alone_name}, {fed_um:.1} um with {fed_name}.",
        velocity = VELOCITIES_MM_S[0],
        alone_name = alone.name(),
        fed_name = fed.name(),
        alone_um = deviation_um(alone),
        fed_um = deviation_um(fed),
    )
}

fn best_pid_prose() -> String {
    format!(
        "The best PID is the one that commissioning designs: the least error after a step of the load, with |S| up to \
         {SENSITIVITY_PEAK} and |T| up to {COMPLEMENTARY_PEAK} on the sampled loop. The PID of the settings has the thesis' margins, \
         which leave its integral weak; what friction's feedforward is worth on a well-tuned axis is the change against the best PID."
    )
}

fn experiment_prose() -> String {
    format!(
        "The x axis follows a sine of {AMPLITUDE_MM} mm amplitude whose largest velocity is 5, 10 or 15 mm/s. The \
         control law is the firmware's, in f32, at 10 kHz; the stage is simulated. The controllers are those that \
         commissioning the simulated stage designed."
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

/// The error of some configurations about one reversal, every tick of it.
fn reversal_figure(
    id: String,
    comparison: &Comparison,
    configurations: &[Configuration],
    knowledge: ModelKnowledge,
    velocity_mm_s: f64,
) -> Figure {
    let find = |&configuration: &Configuration| {
        comparison.find(configuration, knowledge, AMPLITUDE_MM, velocity_mm_s)
    };
    let series = configurations
        .iter()
        .filter_map(find)
        .enumerate()
        .filter_map(|(index, entry)| {
            let Reversal { time_s, error_um } = Reversal::of(&entry.last_cycle)?;
            let name = entry.configuration.name();
            Some(series(&name, time_s, error_um, Style::nth(index)))
        })
        .collect();
    let caption = format!(
        "Tracking error about one reversal at {velocity_mm_s} mm/s, every control period, {}",
        knowledge.friction()
    );
    lines(
        &id,
        &caption,
        ("time from the reversal (s)", "tracking error (um)"),
        series,
    )
}
