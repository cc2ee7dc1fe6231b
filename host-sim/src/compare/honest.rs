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

/// The stage with the best PID on the x axis, which the comparison drives, if a model of it is known; no nonlinear gain.
///
/// # Errors
/// A model that no PID keeps the bounds on.
pub fn with_best_pid(stage: &StageSettings) -> Result<StageSettings, DesignError> {
    let mut stage = stage.clone();
    let form = Form::Sampled {
        sample_time_s: 1.0 / stage.rate_hz,
        computation_delay_s: 0.0,
    };
    let [x, ..] = &mut stage.axes;
    if let Some(plant) = x.plant {
        let filter_s = x.feedback.pid.derivative_filter_s;
        let filters = x.feedback.filters.as_deref().unwrap_or_default();
        x.feedback.pid = best_pid(&Process::filtered(plant, filters), form, filter_s)?.gains;
        x.feedback.nonlinear = None;
        x.feedback.law = LawKind::Pid;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_that_is_driven_gets_the_best_pid_and_the_others_keep_theirs() {
        let stage = StageSettings::simulated();
        let best = with_best_pid(&stage).unwrap();
        assert_eq!(best.axes[1..], stage.axes[1..]);
        let pid = best.axes[0].feedback.pid;
        // `quadrant design pid` on the sampled loop with an integral share of 0.05, the best of the three.
        assert_eq!(pid.ki_v_per_mm_s, 80.0);
        let near = |found: f64, known: f64| assert!((found / known - 1.0).abs() < 1e-6, "{pid:?}");
        near(pid.kp_v_per_mm, 1.266_228);
        near(pid.kd_v_s_per_mm, 0.004_189_688_5);
    }
}
