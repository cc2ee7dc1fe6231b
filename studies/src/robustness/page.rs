//! The robustness experiment's tables: one for each score, and one of everything.

use quadrant_pages::parts::{UM_PER_MM, statistic_cells};
use quadrant_report::{Block, Cell, Column, Table};
use quadrant_sim::metrics::{Metric, Score, change_percent};

use super::{Outcome, Request, baseline, find};

/// The tables.
pub(super) fn blocks(request: &Request, outcomes: &[Outcome]) -> Vec<Block> {
    let mut tables = Metric::ALL
        .map(|metric| score_table(metric, request, outcomes))
        .to_vec();
    tables.push(full_table(request, outcomes));
    tables.into_iter().map(Block::Table).collect()
}

/// A score, with the change against the same competitor in the nominal scenario of the task.
fn score_table(metric: Metric, request: &Request, outcomes: &[Outcome]) -> Table {
    let mut columns = vec![Column::new("Scenario")];
    for (competitor, _) in &request.competitors {
        columns.push(Column::with_unit(competitor, "um"));
        columns.push(Column::with_unit("change", "%"));
    }
    let rows = request
        .scenarios
        .iter()
        .map(|scenario| {
            let cells = request.competitors.iter().flat_map(|(competitor, _)| {
                let outcome = find(outcomes, &scenario.name, competitor);
                outcome.map_or([Cell::Missing, Cell::Missing], |outcome| {
                    score_cells(metric.read, outcome, outcomes)
                })
            });
            std::iter::once(Cell::text(&scenario.name))
                .chain(cells)
                .collect()
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
fn score_cells(read: fn(&Score) -> f64, outcome: &Outcome, outcomes: &[Outcome]) -> [Cell; 2] {
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
fn full_table(request: &Request, outcomes: &[Outcome]) -> Table {
    let mut columns = ["Scenario", "What is different", "Task", "Law"]
        .map(Column::new)
        .to_vec();
    for Metric { name, .. } in Metric::ALL {
        columns.push(Column::with_unit(name, "um"));
        columns.push(Column::with_unit(format!("{name} +-"), "um"));
    }
    columns.extend(["Runs", "Switched off"].map(Column::new));
    let difference = |outcome: &Outcome| {
        let scenario = request
            .scenarios
            .iter()
            .find(|it| it.name == outcome.scenario);
        scenario.map_or("", |it| it.what.as_str())
    };
    let rows = outcomes
        .iter()
        .map(|outcome| {
            let mut row = vec![
                Cell::text(&outcome.scenario),
                Cell::text(difference(outcome)),
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
        caption: "Every scenario and law: mean and standard deviation over the seeds. The numbers of the scenarios are chosen, none \
                  measured"
            .to_owned(),
        columns,
        rows,
    }
}
