//! The comparison at a glance: what friction's feedforward is worth on a well-tuned axis.

use crate::compare::comparison::Comparison;
use crate::compare::reversal::Reversal;
use crate::compare::sine::{AMPLITUDE_MM, VELOCITIES_MM_S};
use crate::experiment::configuration::{Configuration, Gains};
use crate::experiment::metrics::{Metric, change_percent};
use crate::experiment::run_configuration::ModelKnowledge;
use crate::pages::UM_PER_MM;
use crate::report::{Cell, Column, Table};

/// Knowledge of the plant that a real axis allows.
const KNOWLEDGE: ModelKnowledge = ModelKnowledge::Identified;

/// The result of the comparison, small enough for a terminal.
#[derive(Clone, Debug)]
pub struct Glance {
    /// The result in a sentence.
    pub sentence: String,
    /// The errors of four laws.
    pub table: Table,
    /// A reversal of the best PID alone, and with feedforward.
    pub reversals: Vec<(String, Reversal)>,
}

impl Glance {
    /// The glance at a comparison that has all of [`Configuration::USUAL`]. `own` is whose gains the settings have: "the thesis'".
    pub fn of(comparison: &Comparison, own: &str) -> Self {
        let [alone, fed, ..] = Configuration::USUAL;
        let reversal = |configuration: Configuration| {
            let entry =
                comparison.find(configuration, KNOWLEDGE, AMPLITUDE_MM, VELOCITIES_MM_S[0])?;
            Some((configuration.name(), Reversal::of(&entry.last_cycle)?))
        };
        Self {
            sentence: sentence(comparison, [alone, fed]),
            table: glance_table(comparison, own),
            reversals: [alone, fed].into_iter().filter_map(reversal).collect(),
        }
    }
}

/// Returns the largest errors at the velocities, um; none of what was not run.
fn largest_um(comparison: &Comparison, configuration: Configuration) -> Vec<f64> {
    let find = |&velocity: &f64| comparison.find(configuration, KNOWLEDGE, AMPLITUDE_MM, velocity);
    VELOCITIES_MM_S
        .iter()
        .filter_map(find)
        .map(|entry| UM_PER_MM * entry.statistic(Metric::ALL[0].read).mean)
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn mean_change_percent(from: &[f64], to: &[f64]) -> f64 {
    let changes = from.iter().zip(to);
    let changes: Vec<f64> = changes
        .map(|(from, to)| change_percent(*from, *to))
        .collect();
    mean(&changes)
}

fn sentence(comparison: &Comparison, [alone, fed]: [Configuration; 2]) -> String {
    let [alone, fed] = [alone, fed].map(|configuration| largest_um(comparison, configuration));
    let change = mean_change_percent(&alone, &fed);
    let effect = if change < 0.0 {
        format!(
            "takes {:.0} % off the largest error that the best PID leaves",
            -change
        )
    } else {
        format!("does not help here: the largest error is {change:.0} % above the best PID's")
    };
    format!(
        "Feedforward of friction {effect}: {fed:.1} um in place of {alone:.1} um, mean over 5, 10 and 15 mm/s. \
         Simulated, not measured.",
        fed = mean(&fed),
        alone = mean(&alone),
    )
}

fn glance_table(comparison: &Comparison, own: &str) -> Table {
    let baseline = largest_um(comparison, Configuration::BEST_PID);
    let rows = Configuration::USUAL
        .into_iter()
        .map(|configuration| {
            let name = match configuration.gains {
                Gains::BestPid => configuration.name(),
                Gains::Settings => format!("{own} {}", configuration.name()),
            };
            let errors = largest_um(comparison, configuration);
            let mut row = vec![Cell::text(name)];
            row.extend(errors.iter().map(|error| Cell::number(*error, 1)));
            row.push(if configuration == Configuration::BEST_PID {
                Cell::Missing
            } else {
                Cell::number(mean_change_percent(&baseline, &errors), 0)
            });
            row
        })
        .collect();
    let mut columns = vec![Column::new("Law")];
    columns.extend(
        VELOCITIES_MM_S.map(|velocity| Column::with_unit(format!("{velocity} mm/s"), "um")),
    );
    columns.push(Column::with_unit("Change", "%"));
    Table {
        id: "best-pid".to_owned(),
        caption: format!(
            "Largest error on a sine of {AMPLITUDE_MM} mm; {}",
            KNOWLEDGE.friction()
        ),
        columns,
        rows,
    }
}
