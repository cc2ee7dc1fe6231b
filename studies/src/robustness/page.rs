//! The robustness experiment's tables and figures.

use quadrant_pages::parts::{UM_PER_MM, statistic_cells};
use quadrant_report::{Block, Cell, Column, Section, Table};
use quadrant_sim::metrics::{Metric, Score, change_percent};

use crate::robustness::compliance::{Compliance, FREQUENCIES_HZ, LOAD_V};
use crate::robustness::figures::{compliance_figure, dots, error_figure};
use crate::robustness::study::RobustnessReport;
use crate::robustness::{RobustnessOutcome, baseline, find};

impl RobustnessReport {
    /// The competitors, in the order in which they ran.
    pub(super) fn competitors(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for outcome in &self.outcomes {
            if !names.contains(&outcome.competitor.as_str()) {
                names.push(&outcome.competitor);
            }
        }
        names
    }
}

/// The tables: one for each score, with the change against the same competitor in the nominal scenario of the task; the
/// drives that were refused; the compliances.
pub fn robustness_tables(report: &RobustnessReport) -> Vec<Table> {
    let mut tables: Vec<Table> = Metric::ALL
        .into_iter()
        .map(|metric| score_table(metric, report))
        .collect();
    if !report.refused.is_empty() {
        tables.push(refused_table(report));
    }
    if !report.compliances.is_empty() {
        tables.push(compliance_table(&report.compliances));
    }
    tables
}

fn score_table(metric: Metric, report: &RobustnessReport) -> Table {
    let competitors = report.competitors();
    let mut columns = vec![Column::new("Scenario")];
    for competitor in &competitors {
        columns.push(Column::with_unit(*competitor, "um"));
        columns.push(Column::with_unit("change", "%"));
    }
    let rows = report
        .scenarios
        .iter()
        .map(|scenario| {
            let mut row = vec![Cell::text(&scenario.name)];
            for competitor in &competitors {
                let outcome = find(&report.outcomes, &scenario.name, competitor);
                row.extend(outcome.map_or([Cell::Missing, Cell::Missing], |outcome| {
                    score_cells(metric.read, outcome, &report.outcomes)
                }));
            }
            row
        })
        // A task without reversals has no glitch.
        .filter(|row: &Vec<Cell>| row[1..].iter().any(|cell| *cell != Cell::Missing))
        .collect();
    Table {
        id: format!("robustness-{}", metric.name.to_lowercase()),
        caption: format!(
            "{}, mean over the seeds; change against the same law in the nominal scenario of the same task",
            metric.title
        ),
        columns,
        rows,
    }
}

/// A score and its change; where every run was switched off, the fault's number.
fn score_cells(
    read: fn(&Score) -> f64,
    outcome: &RobustnessOutcome,
    outcomes: &[RobustnessOutcome],
) -> [Cell; 2] {
    let Some(own) = outcome.statistic(read) else {
        let faults = outcome.faults();
        let cell = faults.first().map_or(Cell::Missing, |fault| {
            Cell::text(format!("fault {}", fault.code.number()))
        });
        return [cell, Cell::Missing];
    };
    let nominal =
        baseline(outcomes, outcome).filter(|nominal| nominal.scenario != outcome.scenario);
    let change = nominal.and_then(|nominal| nominal.statistic(read));
    [
        Cell::number(own.mean * UM_PER_MM, 2),
        change.map_or(Cell::Missing, |from| {
            Cell::number(change_percent(from.mean, own.mean), 1)
        }),
    ]
}

/// Every number with its spread.
pub fn robustness_full_table(report: &RobustnessReport) -> Table {
    let mut columns = vec![
        Column::new("Scenario"),
        Column::new("Task"),
        Column::new("Law"),
    ];
    for Metric { name, .. } in Metric::ALL {
        columns.push(Column::with_unit(name, "um"));
        columns.push(Column::with_unit(format!("{name} +-"), "um"));
    }
    columns.extend([Column::new("Runs"), Column::new("Switched off")]);
    let rows = report
        .outcomes
        .iter()
        .map(|outcome| {
            let mut row = vec![
                Cell::text(&outcome.scenario),
                Cell::text(outcome.task.name()),
                Cell::text(&outcome.competitor),
            ];
            for metric in Metric::ALL {
                let statistic = outcome.statistic(metric.read);
                row.extend(statistic_cells(statistic, UM_PER_MM, 2));
            }
            row.push(Cell::number(outcome.runs.len() as f64, 0));
            let faults = outcome.faults();
            row.push(Cell::text(faults.first().map_or(String::new(), |fault| {
                format!("{} by fault {}", faults.len(), fault.code.number())
            })));
            row
        })
        .collect();
    Table {
        id: "robustness".to_owned(),
        caption: "Every scenario and law: mean and standard deviation over the seeds".to_owned(),
        columns,
        rows,
    }
}

fn refused_table(report: &RobustnessReport) -> Table {
    Table {
        id: "robustness-refused".to_owned(),
        caption: "Drives on which the commissioning ended early".to_owned(),
        columns: vec![
            Column::new("Drive"),
            Column::new("What it is"),
            Column::new("Why"),
        ],
        rows: report
            .refused
            .iter()
            .map(|(drive, why)| {
                let why = why.to_string();
                [&drive.name, &drive.what, &why].map(Cell::text).into()
            })
            .collect(),
    }
}

fn scenario_table(report: &RobustnessReport) -> Table {
    Table {
        id: "robustness-scenarios".to_owned(),
        caption: "The scenarios; their numbers are chosen, none measured".to_owned(),
        columns: vec![
            Column::new("Scenario"),
            Column::new("Task"),
            Column::new("What is different"),
        ],
        rows: report
            .scenarios
            .iter()
            .map(|scenario| {
                [scenario.name.as_str(), scenario.task.name(), &scenario.what]
                    .map(Cell::text)
                    .into()
            })
            .collect(),
    }
}

fn compliance_table(compliances: &[Compliance]) -> Table {
    let mut columns = vec![Column::with_unit("Frequency", "Hz")];
    columns.extend(
        compliances
            .iter()
            .map(|compliance| Column::with_unit(&compliance.name, "um/V")),
    );
    let rows = FREQUENCIES_HZ
        .iter()
        .enumerate()
        .map(|(index, frequency_hz)| {
            let mut row = vec![Cell::number(*frequency_hz, 0)];
            row.extend(compliances.iter().map(|compliance| {
                compliance.mm_per_v[index]
                    .map_or(Cell::Missing, |value| Cell::number(value * UM_PER_MM, 2))
            }));
            row
        })
        .collect();
    Table {
        id: "robustness-compliance".to_owned(),
        caption: format!(
            "Largest error at rest under a sinusoidal load of {LOAD_V} V at the amplifier's input, over that load"
        ),
        columns,
        rows,
    }
}

/// The report's sections: scenarios, scores, errors over time under loads, compliance.
pub fn robustness_sections(report: &RobustnessReport) -> Vec<Section> {
    let mut scores: Vec<Block> = robustness_tables(report)
        .into_iter()
        .filter(|table| table.id != "robustness-compliance")
        .map(Block::Table)
        .collect();
    scores.insert(0, Block::Figure(dots(report)));
    scores.push(Block::Table(robustness_full_table(report)));
    let mut sections = vec![
        Section {
            provenance: None,
            id: "robustness-scenarios-section".to_owned(),
            heading: "Scenarios".to_owned(),
            prose: vec![scenario_prose()],
            blocks: vec![Block::Table(scenario_table(report))],
        },
        Section {
            provenance: None,
            id: "robustness-scores".to_owned(),
            heading: "Errors by scenario".to_owned(),
            prose: vec![],
            blocks: scores,
        },
        Section {
            provenance: None,
            id: "robustness-errors".to_owned(),
            heading: "Error over time under a load".to_owned(),
            prose: vec![],
            blocks: report
                .scenarios
                .iter()
                .filter(|scenario| scenario.keeps_trace)
                .map(|scenario| Block::Figure(error_figure(report, scenario)))
                .collect(),
        },
    ];
    if !report.compliances.is_empty() {
        sections.push(Section {
            provenance: None,
            id: "robustness-compliance-section".to_owned(),
            heading: "Compliance".to_owned(),
            prose: vec![compliance_prose()],
            blocks: vec![
                Block::Figure(compliance_figure(&report.compliances)),
                Block::Table(compliance_table(&report.compliances)),
            ],
        });
    }
    sections
}

fn scenario_prose() -> String {
    "The settings are those of the axis as it was commissioned, and stay as they are while the axis changes. Another drive \
     is another machine: there each law has the gains and models that the same commissioning found on it. A stage that \
     switches itself off is a result, given as its fault's number. Simulated, not measured."
        .to_owned()
}

fn compliance_prose() -> String {
    "The linear model's compliance is P / (1 + L), with the identified plant and the sampled loop of its PID. Without \
     friction the simulated axis must show the same. On the axis as it is, friction takes part of the load, and the error is \
     not proportional to it: the points hold for this amplitude. At rest the feedforward is silent; laws that differ in \
     nothing else are one."
        .to_owned()
}
