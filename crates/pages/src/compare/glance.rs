//! The comparison at a glance: what friction's feedforward is worth on a well-tuned axis.

use quadrant_report::{Cell, Column, Table};
use quadrant_sim::metrics::{Metric, change_percent};

use crate::compare::comparison::Comparison;
use crate::compare::reversal::Reversal;
use crate::compare::sine::Sines;
use crate::compare::subject::Subject;
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::ModelKnowledge;
use crate::parts::UM_PER_MM;

/// Knowledge of the plant that a real axis allows.
const KNOWLEDGE: ModelKnowledge = ModelKnowledge::Identified;

/// The result of the comparison, small enough for a terminal.
#[derive(Clone, Debug)]
pub struct Glance {
    /// The result in a sentence.
    pub sentence: String,
    /// The errors of a few laws.
    pub table: Table,
    /// A reversal of the best PID alone, and of the law whose effect is the result.
    pub reversals: Vec<(String, Reversal)>,
}

impl Glance {
    /// The glance at the comparison of a subject.
    pub fn of(comparison: &Comparison, subject: &Subject) -> Self {
        let slowest = subject.sines.velocities_mm_s[0];
        let reversal = |configuration: Configuration| {
            let amplitude_mm = subject.sines.amplitude_mm;
            let entry = comparison.find(configuration, KNOWLEDGE, amplitude_mm, slowest)?;
            Some((configuration.name(), Reversal::of(&entry.last_cycle)?))
        };
        Self {
            sentence: sentence(comparison, subject),
            table: glance_table(comparison, subject),
            reversals: subject.shown.into_iter().filter_map(reversal).collect(),
        }
    }
}

/// Returns the largest errors at the velocities, um; none of what was not run.
fn largest_um(comparison: &Comparison, configuration: Configuration, sines: &Sines) -> Vec<f64> {
    let find =
        |&velocity: &f64| comparison.find(configuration, KNOWLEDGE, sines.amplitude_mm, velocity);
    sines
        .velocities_mm_s
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

fn sentence(comparison: &Comparison, subject: &Subject) -> String {
    let [alone, fed] = subject
        .shown
        .map(|configuration| largest_um(comparison, configuration, &subject.sines));
    let change = mean_change_percent(&alone, &fed);
    let effect = if change < 0.0 {
        format!("takes {:.0} % off the best PID's largest error", -change)
    } else {
        format!("does not help here: the largest error is {change:.0} % above the best PID's")
    };
    let (law, kept) = match &subject.chosen {
        None => ("Feedforward of friction".to_owned(), ""),
        Some(chosen) if subject.shown[1] == Configuration::COMMISSIONED => {
            (format!("{chosen}, commissioned on {},", subject.axis()), "")
        }
        Some(_) => (
            format!("Feedforward of friction on {}", subject.axis()),
            " Commissioning kept the PID alone: on some of its own sines nothing was better.",
        ),
    };
    let mean_over = if subject.sines.velocities_mm_s.len() > 1 {
        format!("mean over {}", subject.velocities())
    } else {
        format!("at {}", subject.velocities())
    };
    format!(
        "{law} {effect}: {fed:.1} um in place of {alone:.1} um, {mean_over}.{kept} Simulated, not measured.",
        fed = mean(&fed),
        alone = mean(&alone),
    )
}

fn glance_table(comparison: &Comparison, subject: &Subject) -> Table {
    let sines = &subject.sines;
    let baseline = largest_um(comparison, Configuration::BEST_PID, sines);
    let rows = subject
        .few
        .iter()
        .map(|&configuration| {
            let errors = largest_um(comparison, configuration, sines);
            let mut row = vec![Cell::text(subject.name(configuration))];
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
    let velocities = sines.velocities_mm_s.iter();
    columns.extend(velocities.map(|velocity| Column::with_unit(format!("{velocity} mm/s"), "um")));
    columns.push(Column::with_unit("Change", "%"));
    Table {
        id: "best-pid".to_owned(),
        caption: format!(
            "Largest error on a sine of {} mm; {}",
            sines.amplitude_mm,
            KNOWLEDGE.friction()
        ),
        columns,
        rows,
    }
}
