//! The comparison's tables and page.

use quadrant::control::feedback::LawKind;

use crate::circle::CircleOutcome;
use crate::circle::single_page::{circle_figures, circle_table, polar_figure};
use crate::compare::comparison::Comparison;
use crate::compare::headlines::{HEADLINE_PROSE, headline_table};
use crate::compare::honest::{error_columns, honest_table};
use crate::compare::sine::{AMPLITUDE_MM, VELOCITIES_MM_S};
use crate::experiment::configuration::Configuration;
use crate::experiment::metrics::{GLITCH_WINDOW, Metric};
use crate::experiment::run_configuration::ModelKnowledge;
use crate::pages::{UM_PER_MM, error_curve};
use crate::report::{Block, Cell, Figure, Lines, Page, Plot, Provenance, Section, Style, Table};

/// Control period of the outcomes' traces, s.
const PERIOD_S: f64 = 1e-4;

/// Names of the tables of [`Metric::ALL`].
const IDS: [&str; 3] = [
    "tracking-error-largest",
    "tracking-error-rms",
    "quadrant-glitch",
];

/// The comparison's tables: that against the best PID, one for each score, the headlines, the circles.
pub fn comparison_tables(
    comparison: &Comparison,
    honest: &Comparison,
    circles: &[CircleOutcome],
) -> Vec<Table> {
    let scores = IDS
        .into_iter()
        .zip(Metric::ALL)
        .map(|(id, metric)| score_table(id, metric, comparison));
    std::iter::once(honest_table(comparison, honest))
        .chain(scores)
        .chain([headline_table(comparison, honest), circle_table(circles)])
        .collect()
}

fn score_table(id: &str, metric: Metric, comparison: &Comparison) -> Table {
    let value = |configuration, knowledge, velocity| {
        comparison
            .find(configuration, knowledge, AMPLITUDE_MM, velocity)
            .map(|entry| entry.statistic(metric.read).mean * UM_PER_MM)
    };
    let rows = Configuration::all()
        .into_iter()
        .map(|configuration| {
            let mut row = vec![Cell::text(configuration.name())];
            for knowledge in ModelKnowledge::ALL {
                let mut changes = Vec::new();
                for velocity in VELOCITIES_MM_S {
                    let own = value(configuration, knowledge, velocity);
                    let baseline = value(Configuration::PID, knowledge, velocity);
                    row.push(own.map_or(Cell::Missing, |um| Cell::number(um, 2)));
                    changes.extend(
                        own.zip(baseline)
                            .map(|(own, from)| (own / from - 1.0) * 100.0),
                    );
                }
                row.push(
                    if configuration == Configuration::PID || changes.is_empty() {
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
        caption: format!("{} over two cycles; change against PID alone", metric.title),
        columns: error_columns("Configuration"),
        rows,
    }
}

/// The comparison's page.
pub fn comparison_page(
    comparison: &Comparison,
    honest: &Comparison,
    circles: &[CircleOutcome],
    provenance: Provenance,
) -> Page {
    let mut tables = comparison_tables(comparison, honest, circles).into_iter();
    let mut next_tables = |count| {
        tables
            .by_ref()
            .take(count)
            .map(Block::Table)
            .collect::<Vec<_>>()
    };
    let against_best = next_tables(1);
    let scores = next_tables(IDS.len());
    let headlines = next_tables(1);
    let circle_tables = next_tables(1);
    let errors = |knowledge: ModelKnowledge| {
        VELOCITIES_MM_S
            .iter()
            .map(|&velocity| Block::Figure(error_figure(comparison, knowledge, velocity)))
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
                id: "glance".to_owned(),
                heading: "At a glance".to_owned(),
                prose: vec![glance_prose(circles)],
                blocks: std::iter::once(polar_figure("circle-glance", circles, |configuration| {
                    Configuration::EXTREMES.contains(&configuration)
                }))
                .chain(reversal_figure(comparison))
                .map(Block::Figure)
                .collect(),
            },
            Section {
                provenance: None,
                id: "against-best-pid".to_owned(),
                heading: "Against the best PID".to_owned(),
                prose: vec![BEST_PID_PROSE.to_owned()],
                blocks: against_best,
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
                heading: "Error over time, exact model".to_owned(),
                prose: vec![],
                blocks: errors(ModelKnowledge::Exact),
            },
            Section {
                provenance: None,
                id: "identified-model".to_owned(),
                heading: "Error over time, identified model".to_owned(),
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

/// Part of the cycle before and after the reversal that is shown.
const REVERSAL: (f64, f64) = (0.003, 0.022);
/// The laws whose reversal is shown.
const SHOWN: [Configuration; 3] = [
    Configuration::PID,
    Configuration {
        controller: LawKind::NPid,
        ..Configuration::PID
    },
    Configuration::BEST,
];

fn glance_prose(circles: &[CircleOutcome]) -> String {
    let deviation_um = |configuration| {
        let found = circles
            .iter()
            .find(|circle| circle.configuration == configuration);
        found.map_or(f64::NAN, |circle| circle.circular_deviation_mm * UM_PER_MM)
    };
    let [pid, full] = Configuration::EXTREMES;
    format!(
        "A circle of the simulated XY stage, and one reversal of its x axis at {velocity} mm/s. Where an axis reverses, friction \
         holds it, and the error of {pid_name} rises until it breaks away: the quadrant glitch. {full_name} puts the friction's \
         voltage out before it is missed. Circular deviation: {pid_um:.1} um and {full_um:.1} um. The N-PID alone trembles while \
         it waits for the break-away: its gain is largest where its error is, and little margin is left there. With \
         feedforward the error stays small, and so does the gain.",
        velocity = VELOCITIES_MM_S[0],
        pid_name = pid.name(),
        full_name = full.name(),
        pid_um = deviation_um(pid),
        full_um = deviation_um(full),
    )
}

/// The error about a reversal in the middle of the cycle, every tick of it.
fn reversal_figure(comparison: &Comparison) -> Option<Figure> {
    let velocity_mm_s = VELOCITIES_MM_S[0];
    let mut series = Vec::new();
    for (index, configuration) in SHOWN.into_iter().enumerate() {
        let knowledge = ModelKnowledge::Identified;
        let entry = comparison.find(configuration, knowledge, AMPLITUDE_MM, velocity_mm_s)?;
        let cycle = &entry.last_cycle;
        let count = cycle.reference_mm.len();
        let quarter = count / 4..count - count / 4;
        let extreme = |index: &usize| cycle.reference_mm[*index].abs();
        let at = quarter.max_by(|one, other| extreme(one).total_cmp(&extreme(other)))?;
        let part = |share: f64| (share * count as f64) as usize;
        let (from, to) = (at.saturating_sub(part(REVERSAL.0)), at + part(REVERSAL.1));
        let error_mm = cycle.error_mm.get(from..to)?;
        let mut curve = error_curve(configuration.name(), error_mm, PERIOD_S, Style::nth(index));
        let before_s = (at - from) as f64 * PERIOD_S;
        curve.x.iter_mut().for_each(|time_s| *time_s -= before_s);
        series.push(curve);
    }
    Some(Figure {
        id: "reversal".to_owned(),
        caption: format!(
            "Tracking error about one reversal at {velocity_mm_s} mm/s, every control period, identified model"
        ),
        plot: Plot::Lines(Lines {
            x_label: "time from the reversal (s)".to_owned(),
            y_label: "tracking error (um)".to_owned(),
            series,
            ..Lines::default()
        }),
    })
}

/// Said with the table against the best PID.
const BEST_PID_PROSE: &str = "The PID of the settings has the thesis' margins, which leave its integral weak. The best PID is the one that \
     commissioning designs: as much is asked of its loop as of any, and the rest of its freedom goes into a small error. What friction's \
     feedforward is worth on a well-tuned axis is the change against it.";

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

fn error_figure(comparison: &Comparison, knowledge: ModelKnowledge, velocity_mm_s: f64) -> Figure {
    let series = Configuration::all()
        .into_iter()
        .enumerate()
        .filter_map(|(index, configuration)| {
            let entry = comparison.find(configuration, knowledge, AMPLITUDE_MM, velocity_mm_s)?;
            let error = &entry.last_cycle.error_mm;
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
