//! The thesis' headline figures beside ours, and the share of each imperfection in what they lack.

use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Comparison};
use quadrant_pages::compare::headlines::{HEADLINE_PROSE, headline_table};
use quadrant_pages::compare::sine::VELOCITIES_MM_S;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::ModelKnowledge;
use quadrant_pages::experiment::statistic::Statistic;
use quadrant_pages::parts::{UM_PER_MM, statistic_cells};
use quadrant_report::{Block, Cell, Column, Section, Table};
use quadrant_sim::metrics::Metric;

use super::Context;
use super::imperfections::{Change, Finding, study};
use crate::study::Advance;

/// The measures of the best configuration, with the thesis' figure for each, %. It does not say whether its tracking error is a
/// largest or an RMS value: it is set beside both.
const BEST_MEASURES: [(Metric, f64); 3] = [
    (Metric::LARGEST, -96.5),
    (Metric::RMS, -96.5),
    (Metric::GLITCH, -50.0),
];

/// Most seeds that the study of imperfections is run with: what it asks about is many times the deviations.
const STUDY_SEEDS: u64 = 3;
/// Share of the part's time that the comparison takes.
const COMPARISON_SHARE: f64 = 0.7;

/// The headlines, and what limits ours.
pub(super) fn sections(context: &Context, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
    let comparison = context.comparison(&|done| advance(COMPARISON_SHARE * done))?;
    let [_, identified] = context.setups();
    let findings = study(
        &identified,
        &Change::ALL,
        context.seed,
        context.seeds.min(STUDY_SEEDS),
        &|done| advance((1.0 - COMPARISON_SHARE) * done),
    )?;
    Ok(vec![headline_section(comparison), study_section(&findings)])
}

/// The headlines, and the best configuration by velocity.
pub fn headline_section(comparison: &Comparison) -> Section {
    Section {
        id: "headline".to_owned(),
        heading: "The thesis' headlines".to_owned(),
        provenance: None,
        prose: vec![HEADLINE_PROSE.to_owned()],
        blocks: vec![
            Block::Table(headline_table(comparison)),
            Block::Table(best_table(comparison)),
        ],
    }
}

fn best_table(comparison: &Comparison) -> Table {
    let mut rows = Vec::new();
    for (measure, thesis_percent) in BEST_MEASURES {
        for velocity in VELOCITIES_MM_S {
            let mut row = vec![
                Cell::text(measure.name),
                Cell::number(velocity, 0),
                Cell::number(thesis_percent, 1),
            ];
            for knowledge in ModelKnowledge::ALL {
                for configuration in Configuration::EXTREMES {
                    let entry =
                        comparison.find(configuration, knowledge, AMPLITUDES_MM[0], velocity);
                    row.push(entry.map_or(Cell::Missing, |entry| {
                        Cell::number(UM_PER_MM * entry.statistic(measure.read).mean, 2)
                    }));
                }
                let changes = comparison.changes_percent(
                    knowledge,
                    measure,
                    Configuration::EXTREMES,
                    &[velocity],
                );
                let [change, deviation] = statistic_cells(changes, 1.0, 2);
                row.push(change);
                if knowledge == ModelKnowledge::Identified {
                    row.push(deviation);
                }
            }
            rows.push(row);
        }
    }
    let mut columns = vec![
        Column::new("Measure"),
        Column::with_unit("Velocity", "mm/s"),
        Column::with_unit("Thesis", "%"),
    ];
    for name in ModelKnowledge::ALL.map(ModelKnowledge::short) {
        columns.push(Column::with_unit(format!("PID, {name}"), "um"));
        columns.push(Column::with_unit(format!("Best, {name}"), "um"));
        columns.push(Column::with_unit(format!("Change, {name}"), "%"));
    }
    columns.push(Column::with_unit("±", "%"));
    Table {
        id: "headline-best".to_owned(),
        caption: "The best configuration, N-PID with static and GMS feedforward, against PID alone, by measure and velocity"
            .to_owned(),
        columns,
        rows,
    }
}

/// The cost of each imperfection of the plant and of the identified model.
pub fn study_section(findings: &[Finding]) -> Section {
    let rows = findings
        .iter()
        .map(|finding| {
            let mut row = vec![Cell::text(finding.change.name())];
            for (measure, _) in BEST_MEASURES {
                for velocity in VELOCITIES_MM_S {
                    let [mean, _] =
                        statistic_cells(change_percent_of(finding, measure, &[velocity]), 1.0, 2);
                    row.push(mean);
                }
                let [mean, _] = statistic_cells(
                    change_percent_of(finding, measure, &VELOCITIES_MM_S),
                    1.0,
                    2,
                );
                row.push(mean);
            }
            row
        })
        .collect();
    let mut columns = vec![Column::new("Change")];
    for (measure, _) in BEST_MEASURES {
        for velocity in VELOCITIES_MM_S {
            columns.push(Column::with_unit(
                format!("{}, {velocity} mm/s", measure.name),
                "%",
            ));
        }
        columns.push(Column::with_unit(format!("{}, mean", measure.name), "%"));
    }
    let mut prose = vec![
        "The identified model again, with one imperfection of the plant switched off or one thing known better by the law, \
         and nothing else changed: the change from PID alone to N-PID with static and GMS feedforward, both on the changed \
         plant, mean over the seeds."
            .to_owned(),
    ];
    prose.extend(
        BEST_MEASURES
            .iter()
            .filter_map(|&(measure, thesis_percent)| conclusion(findings, measure, thesis_percent)),
    );
    prose.extend(findings.iter().filter_map(|finding| {
        let error = finding.outcome.as_ref().err()?;
        Some(format!("Left out: {} ({error:#}).", finding.change.name()))
    }));
    Section {
        id: "headline-imperfections".to_owned(),
        heading: "What keeps the identified model from more".to_owned(),
        provenance: None,
        prose,
        blocks: vec![Block::Table(Table {
            id: "headline-imperfections-changes".to_owned(),
            caption: "Change from PID to N-PID with static and GMS feedforward, with one imperfection switched off at a time"
                .to_owned(),
            columns,
            rows,
        })],
    }
}

/// The change from PID to the best configuration on a changed run, %; nothing if it could not be run.
fn change_percent_of(
    finding: &Finding,
    measure: Metric,
    velocities_mm_s: &[f64],
) -> Option<Statistic> {
    finding.outcome.as_ref().ok()?.changes_percent(
        ModelKnowledge::Identified,
        measure,
        Configuration::EXTREMES,
        velocities_mm_s,
    )
}

/// A sentence on one measure: whether the thesis' figure is met, and which single change helps most.
fn conclusion(findings: &[Finding], measure: Metric, thesis_percent: f64) -> Option<String> {
    let mean = |finding: &Finding| {
        change_percent_of(finding, measure, &VELOCITIES_MM_S)
            .map(|spread| (finding.change, spread.mean))
    };
    let (_, as_it_is) = findings
        .iter()
        .filter_map(mean)
        .find(|(change, _)| *change == Change::AsItIs)?;
    let (helps, helped) = findings
        .iter()
        .filter_map(mean)
        .filter(|(change, _)| change.is_single())
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let verdict = if as_it_is <= thesis_percent {
        "meets"
    } else {
        "falls short of"
    };
    let percent = |value: f64| Cell::number(value, 1).shown();
    Some(format!(
        "{}: {} % {verdict} the thesis' {} %; of the single changes \u{201c}{}\u{201d} helps most, to {} %.",
        measure.name,
        percent(as_it_is),
        percent(thesis_percent),
        helps.name(),
        percent(helped),
    ))
}
