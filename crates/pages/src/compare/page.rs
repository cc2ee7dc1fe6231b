//! The comparison's tables and page.

use quadrant_report::{Block, Cell, Column, Figure, Page, Provenance, Section, Style, Table};
use quadrant_sim::metrics::{GLITCH_WINDOW, Metric, change_percent};
use quadrant_tune::design::{COMPLEMENTARY_PEAK, SENSITIVITY_PEAK};

use crate::circle::CircleOutcome;
use crate::circle::single_page::{circle_figures, circle_table, polar_figure};
use crate::compare::comparison::Comparison;
use crate::compare::glance::Glance;
use crate::compare::headlines::{HEADLINE_PROSE, headline_table};
use crate::compare::reversal::Reversal;
use crate::compare::subject::Subject;
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::ModelKnowledge;
use crate::parts::{UM_PER_MM, lines, series};

/// Names of the tables of [`Metric::ALL`].
const IDS: [&str; 3] = [
    "tracking-error-largest",
    "tracking-error-rms",
    "quadrant-glitch",
];

/// The comparison's tables: one for each score, the headlines if the sines are the thesis', the circles if there are any.
pub fn comparison_tables(
    comparison: &Comparison,
    subject: &Subject,
    circles: &[CircleOutcome],
) -> Vec<Table> {
    let scores = IDS.into_iter().zip(Metric::ALL);
    let mut tables: Vec<Table> = scores
        .map(|(id, metric)| score_table(id, metric, comparison, subject))
        .collect();
    if subject.is_the_thesis() {
        tables.push(headline_table(comparison));
    }
    if !circles.is_empty() {
        tables.push(circle_table(circles));
    }
    tables
}

fn score_table(id: &str, metric: Metric, comparison: &Comparison, subject: &Subject) -> Table {
    let sines = &subject.sines;
    let value = |configuration, knowledge, velocity| {
        comparison
            .find(configuration, knowledge, sines.amplitude_mm, velocity)
            .map(|entry| entry.statistic(metric.read).mean * UM_PER_MM)
    };
    let rows = subject
        .all
        .iter()
        .map(|&configuration| {
            let mut row = vec![Cell::text(configuration.name())];
            for &knowledge in &subject.knowledge {
                let mut changes = Vec::new();
                for &velocity in &sines.velocities_mm_s {
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
        columns: score_columns(subject),
        rows,
    }
}

/// Heads of the errors with each knowledge at each velocity, and of their mean change, beside the configurations.
fn score_columns(subject: &Subject) -> Vec<Column> {
    let mut columns = vec![Column::new("Configuration")];
    for knowledge in &subject.knowledge {
        for velocity in &subject.sines.velocities_mm_s {
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
    subject: &Subject,
    glance: &Glance,
    circles: &[CircleOutcome],
    provenance: Provenance,
) -> Page {
    let mut tables = comparison_tables(comparison, subject, circles).into_iter();
    let scores: Vec<Block> = tables.by_ref().take(IDS.len()).map(Block::Table).collect();
    let section = |id: &str, heading: &str, prose: Vec<String>, blocks: Vec<Block>| Section {
        provenance: None,
        id: id.to_owned(),
        heading: heading.to_owned(),
        prose,
        blocks,
    };
    let mut sections = vec![glance_section(comparison, subject, glance, circles)];
    if subject.is_the_thesis() {
        sections.push(section(
            "summary",
            "The thesis' headlines",
            vec![HEADLINE_PROSE.to_owned(), experiment_prose(subject)],
            tables.by_ref().take(1).map(Block::Table).collect(),
        ));
    }
    let mut prose = vec![metric_prose()];
    if !subject.is_the_thesis() {
        prose.push(experiment_prose(subject));
    }
    let heading = "Tracking error and quadrant glitch";
    sections.push(section("scores", heading, prose, scores));
    for &knowledge in &subject.knowledge {
        let velocities = subject.sines.velocities_mm_s.iter();
        let figures = velocities.map(|&velocity| {
            let id = format!("error-{}-{velocity}", knowledge.name()).replace([' ', '.'], "-");
            let figure =
                reversal_figure(id, comparison, subject, &subject.all, knowledge, velocity);
            Block::Figure(figure)
        });
        sections.push(section(
            match knowledge {
                ModelKnowledge::Exact => "exact-model",
                ModelKnowledge::Identified => "identified-model",
            },
            &format!("A reversal, {}", knowledge.friction()),
            vec![],
            figures.collect(),
        ));
    }
    if !circles.is_empty() {
        let figures = circle_figures(circles).into_iter().map(Block::Figure);
        let blocks = tables.map(Block::Table).chain(figures).collect();
        sections.push(section("circle", "Circle in XY", vec![], blocks));
    }
    Page {
        title: format!("Friction compensation on {}", subject.stage),
        subtitle: if subject.chosen.is_some() {
            "The best PID with each feedforward of friction, and what commissioning chose; simulated, not measured"
        } else {
            "The best PID with and without feedforward of friction, and the thesis' PID and N-PID, each with no, static, GMS \
             and combined feedforward; simulated, not measured"
        }
        .to_owned(),
        provenance,
        sections,
    }
}

fn glance_section(
    comparison: &Comparison,
    subject: &Subject,
    glance: &Glance,
    circles: &[CircleOutcome],
) -> Section {
    let first_reversal = reversal_figure(
        "reversal".to_owned(),
        comparison,
        subject,
        &subject.shown,
        ModelKnowledge::Identified,
        subject.sines.velocities_mm_s[0],
    );
    let mut blocks = vec![Block::Table(glance.table.clone())];
    if !circles.is_empty() {
        let is_shown = |configuration| subject.shown.contains(&configuration);
        blocks.push(Block::Figure(polar_figure(
            "circle-glance",
            circles,
            is_shown,
        )));
    }
    blocks.push(Block::Figure(first_reversal));
    Section {
        provenance: None,
        id: "glance".to_owned(),
        heading: "At a glance".to_owned(),
        prose: vec![
            glance.sentence.clone(),
            glance_prose(subject, circles),
            best_pid_prose(subject),
        ],
        blocks,
    }
}

fn glance_prose(subject: &Subject, circles: &[CircleOutcome]) -> String {
    let reversal = "Where an axis reverses, friction holds it, and the error rises until it breaks away: the quadrant glitch. Feedforward \
                    puts the friction's voltage out before it is missed.";
    let velocity = subject.sines.velocities_mm_s[0];
    if circles.is_empty() {
        return format!(
            "One reversal of {} at {velocity} mm/s. {reversal}",
            subject.axis()
        );
    }
    let deviation_um = |configuration| {
        let found = circles
            .iter()
            .find(|circle| circle.configuration == configuration);
        found.map_or(f64::NAN, |circle| circle.circular_deviation_mm * UM_PER_MM)
    };
    let [alone, fed] = subject.shown;
    format!(
        "A circle of the simulated XY stage, and one reversal of its {axis} axis at {velocity} mm/s. {reversal} Circular deviation: \
         {alone_um:.1} um with the {alone_name}, {fed_um:.1} um with {fed_name}.",
        axis = subject.sines.axis,
        alone_name = alone.name(),
        fed_name = fed.name(),
        alone_um = deviation_um(alone),
        fed_um = deviation_um(fed),
    )
}

fn best_pid_prose(subject: &Subject) -> String {
    let others = if subject.chosen.is_some() {
        "Where the axis oscillated under it, commissioning made it softer. What commissioning chose is the law that was best on its own sines, \
         or the PID alone where nothing was better on all of them."
    } else {
        "The PID of the settings has the thesis' margins, which leave its integral weak; what friction's feedforward is worth on a \
         well-tuned axis is the change against the best PID."
    };
    format!(
        "The best PID is the one that commissioning designs: the least error after a step of the load, with |S| up to \
         {SENSITIVITY_PEAK} and |T| up to {COMPLEMENTARY_PEAK} on the sampled loop. {others}"
    )
}

fn experiment_prose(subject: &Subject) -> String {
    let Subject { sines, .. } = subject;
    let designed = if subject.chosen.is_some() {
        "that commissioning this very stage designed, from what it measured; none was given the stage's own numbers."
    } else if subject.knowledge == ModelKnowledge::ALL {
        "that commissioning the simulated stage designed."
    } else {
        "of the settings that were given."
    };
    let largest = if sines.velocities_mm_s.len() > 1 {
        format!("in turn {}", subject.velocities())
    } else {
        subject.velocities()
    };
    format!(
        "The {} axis follows a sine of {} mm amplitude whose largest velocity is {largest}. The control law is the firmware's, in f32, at \
         10 kHz; the stage is simulated. The controllers are those {designed}",
        sines.axis, sines.amplitude_mm,
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
    subject: &Subject,
    configurations: &[Configuration],
    knowledge: ModelKnowledge,
    velocity_mm_s: f64,
) -> Figure {
    let amplitude_mm = subject.sines.amplitude_mm;
    let find = |&configuration: &Configuration| {
        comparison.find(configuration, knowledge, amplitude_mm, velocity_mm_s)
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
