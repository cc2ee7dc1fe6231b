//! The thesis' headline figures beside ours, and what in the virtual machine costs how much of them.

use quadrant_sim::compare::comparison::{AMPLITUDES_MM, Comparison};
use quadrant_sim::compare::headlines::{HEADLINES, Metric};
use quadrant_sim::compare::sine::VELOCITIES_MM_S;
use quadrant_sim::experiment::configuration::Configuration;
use quadrant_sim::experiment::metrics::change_percent;
use quadrant_sim::experiment::run_configuration::Knowledge;
use quadrant_sim::experiment::statistic::Statistic;
use quadrant_sim::pages::{UM_PER_MM, statistic_cells};
use quadrant_sim::report::{Block, Cell, Column, Section, Table};

use crate::thesis::chapter5::{GLITCH, LARGEST, Measure, RMS};
use crate::thesis::imperfections::{Change, Finding};

/// The measures of the best configuration, with the thesis' figure for each, %. It does not say whether its tracking error is a
/// largest or an RMS value: it is set beside both.
const BEST_MEASURES: [(Measure, f64); 3] = [(LARGEST, -96.5), (RMS, -96.5), (GLITCH, -50.0)];

/// The changes that one measure makes from one configuration to another, %: run by run with the same noise, mean over the
/// velocities.
fn changes_percent(
    comparison: &Comparison,
    knowledge: Knowledge,
    measure: Measure,
    from: Configuration,
    to: Configuration,
    velocities_mm_s: &[f64],
) -> Option<Statistic> {
    let mut of_seeds: Vec<f64> = Vec::new();
    for &velocity in velocities_mm_s {
        let find =
            |configuration| comparison.find(configuration, knowledge, AMPLITUDES_MM[0], velocity);
        let (before, after) = (find(from)?, find(to)?);
        of_seeds.resize(before.scores.len(), 0.0);
        for ((sum, before), after) in of_seeds.iter_mut().zip(&before.scores).zip(&after.scores) {
            *sum += change_percent((measure.read)(before), (measure.read)(after));
        }
    }
    for sum in &mut of_seeds {
        *sum /= velocities_mm_s.len() as f64;
    }
    (!of_seeds.is_empty()).then(|| Statistic::of(&of_seeds))
}

/// The headlines, and the best configuration by velocity.
pub fn headline_section(comparison: &Comparison) -> Section {
    Section {
        id: "headline".to_owned(),
        heading: "The thesis' headlines".to_owned(),
        provenance: None,
        prose: vec![
            "The thesis measured its own stage; ours are simulated on ours, sine of 30 mm, mean over the three velocities. \
             Matched: the feedforward has the plant's own friction. Virtual machine: it has what commissioning found; ± is \
             one standard deviation over the seeds of the noise. The controllers are the same. Neither plant nor gains were tuned to meet the figures."
                .to_owned(),
        ],
        blocks: vec![
            Block::Table(headline_table(comparison)),
            Block::Table(best_table(comparison)),
        ],
    }
}

fn headline_table(comparison: &Comparison) -> Table {
    let rows = HEADLINES
        .iter()
        .map(|headline| {
            let cells = |knowledge, measure| {
                let (from, to) = (headline.from, headline.to);
                statistic_cells(
                    changes_percent(comparison, knowledge, measure, from, to, &VELOCITIES_MM_S),
                    1.0,
                    1,
                )
            };
            let (first, second) = match headline.metric {
                Metric::TrackingError => (LARGEST, Some(RMS)),
                Metric::Glitch => (GLITCH, None),
            };
            let mut row = vec![
                Cell::text(headline.comparison),
                Cell::text(headline.metric.name()),
                Cell::number(headline.change_percent, 1),
            ];
            let [matched, _] = cells(Knowledge::Matched, first);
            row.push(matched);
            row.extend(cells(Knowledge::VirtualMachine, first));
            match second {
                Some(measure) => {
                    let [matched, _] = cells(Knowledge::Matched, measure);
                    row.push(matched);
                    row.extend(cells(Knowledge::VirtualMachine, measure));
                }
                None => row.extend([Cell::Missing, Cell::Missing, Cell::Missing]),
            }
            row
        })
        .collect();
    Table {
        id: "headline-changes".to_owned(),
        caption: "The thesis' headline changes beside ours; tracking error as largest magnitude, and again as RMS".to_owned(),
        columns: vec![
            Column::new("Comparison"),
            Column::new("Metric"),
            Column::with_unit("Thesis", "%"),
            Column::with_unit("Matched", "%"),
            Column::with_unit("Virtual machine", "%"),
            Column::with_unit("±", "%"),
            Column::with_unit("RMS, matched", "%"),
            Column::with_unit("RMS, virtual machine", "%"),
            Column::with_unit("±", "%"),
        ],
        rows,
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
            for knowledge in Knowledge::ALL {
                for configuration in Configuration::EXTREMES {
                    let entry =
                        comparison.find(configuration, knowledge, AMPLITUDES_MM[0], velocity);
                    row.push(entry.map_or(Cell::Missing, |entry| {
                        Cell::number(UM_PER_MM * entry.statistic(measure.read).mean, 2)
                    }));
                }
                let changes = changes_percent(
                    comparison,
                    knowledge,
                    measure,
                    Configuration::PID,
                    Configuration::BEST,
                    &[velocity],
                );
                let [change, deviation] = statistic_cells(changes, 1.0, 2);
                row.push(change);
                if knowledge == Knowledge::VirtualMachine {
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
    for name in ["matched", "virtual"] {
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

/// What each imperfection of the virtual machine costs.
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
    let mut columns = vec![Column::new("Virtual machine")];
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
        "The virtual machine again, with one imperfection of the plant switched off or one thing known better by the law, \
         and nothing else changed: the change from PID alone to N-PID with static and GMS feedforward, both on the changed \
         machine, mean over the seeds."
            .to_owned(),
    ];
    prose.extend(
        BEST_MEASURES
            .iter()
            .filter_map(|&(measure, thesis_percent)| conclusion(findings, measure, thesis_percent)),
    );
    prose.extend(findings.iter().filter_map(|finding| {
        let error = finding.outcome.as_ref().err()?;
        Some(format!("Left out: {} ({error}).", finding.change.name()))
    }));
    Section {
        id: "headline-imperfections".to_owned(),
        heading: "What keeps the virtual machine from more".to_owned(),
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

/// The change from PID to the best configuration on a changed virtual machine, %; nothing if it could not be run.
fn change_percent_of(
    finding: &Finding,
    measure: Measure,
    velocities_mm_s: &[f64],
) -> Option<Statistic> {
    changes_percent(
        finding.outcome.as_ref().ok()?,
        Knowledge::VirtualMachine,
        measure,
        Configuration::PID,
        Configuration::BEST,
        velocities_mm_s,
    )
}

/// A sentence on one measure: whether the thesis' figure is met, and which single change helps most.
fn conclusion(findings: &[Finding], measure: Measure, thesis_percent: f64) -> Option<String> {
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
