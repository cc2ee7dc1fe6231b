//! The comparison against the best PID that the tool designs: no gain is denied to the baseline.

use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::settings::StageSettings;

use crate::compare::comparison::Comparison;
use crate::compare::sine::{AMPLITUDE_MM, VELOCITIES_MM_S};
use crate::design::{DesignError, Form, Process, best_pid};
use crate::experiment::configuration::Configuration;
use crate::experiment::metrics::Metric;
use crate::experiment::run_configuration::ModelKnowledge;
use crate::pages::UM_PER_MM;
use crate::report::{Cell, Column, Table};

/// What runs with the gains of the best PID.
pub const CONFIGURATIONS: [Configuration; 2] = [
    Configuration::PID,
    Configuration {
        controller: LawKind::Pid,
        feedforward: FeedforwardKind::Combined,
    },
];

/// The stage with the best PID on each axis of which a model is known, and no nonlinear gain.
///
/// # Errors
/// A model that no PID keeps the bounds on.
pub fn with_best_pid(stage: &StageSettings) -> Result<StageSettings, DesignError> {
    let mut stage = stage.clone();
    let form = Form::Sampled {
        sample_time_s: 1.0 / stage.rate_hz,
        computation_delay_s: 0.0,
    };
    for axis in &mut stage.axes {
        let Some(plant) = axis.plant else { continue };
        let filter_s = axis.feedback.pid.derivative_filter_s;
        axis.feedback.pid = best_pid(&Process::Model(plant), form, filter_s)?.gains;
        axis.feedback.nonlinear = None;
        axis.feedback.law = LawKind::Pid;
    }
    Ok(stage)
}

/// Columns of errors with each knowledge at each velocity, and of their mean change, beside a column of names.
pub(super) fn error_columns(names: &str) -> Vec<Column> {
    let mut columns = vec![Column::new(names)];
    for knowledge in ModelKnowledge::ALL {
        for velocity in VELOCITIES_MM_S {
            let heading = format!("{} {velocity} mm/s", knowledge.short());
            columns.push(Column::with_unit(heading, "um"));
        }
        let heading = format!("{} mean change", knowledge.short());
        columns.push(Column::with_unit(heading, "%"));
    }
    columns
}

/// The largest errors of the comparison's PID and full law beside those of the best PID, alone and with feedforward; changes
/// against the best PID alone.
pub fn honest_table(comparison: &Comparison, honest: &Comparison) -> Table {
    let [alone, fed] = CONFIGURATIONS;
    let laws = [
        ("PID of the settings", comparison, Configuration::PID),
        ("best PID", honest, alone),
        ("best PID + static + GMS", honest, fed),
        (
            "N-PID + static + GMS of the settings",
            comparison,
            Configuration::BEST,
        ),
    ];
    let largest_um = |of: &Comparison, configuration, knowledge, velocity| {
        let entry = of.find(configuration, knowledge, AMPLITUDE_MM, velocity)?;
        Some(entry.statistic(Metric::ALL[0].read).mean * UM_PER_MM)
    };
    let rows = laws
        .into_iter()
        .map(|(name, of, configuration)| {
            let mut row = vec![Cell::text(name)];
            for knowledge in ModelKnowledge::ALL {
                let mut changes = Vec::new();
                for velocity in VELOCITIES_MM_S {
                    let own = largest_um(of, configuration, knowledge, velocity);
                    let best = largest_um(honest, alone, knowledge, velocity);
                    row.push(own.map_or(Cell::Missing, |um| Cell::number(um, 2)));
                    let pair = own.zip(best);
                    changes.extend(pair.map(|(own, best)| 100.0 * (own / best - 1.0)));
                }
                let mean = changes.iter().sum::<f64>() / changes.len() as f64;
                row.push(if name == laws[1].0 || changes.is_empty() {
                    Cell::Missing
                } else {
                    Cell::number(mean, 1)
                });
            }
            row
        })
        .collect();
    Table {
        id: "best-pid".to_owned(),
        caption: "Largest tracking error against the best PID: least error after a load step with |S| up to 1.7 and |T| up to 1.5 \
                  on the sampled loop"
            .to_owned(),
        columns: error_columns("Law"),
        rows,
    }
}
