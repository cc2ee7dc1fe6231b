//! From outcomes to tables and figures: what a person reads of an experiment.

mod bode;
mod chapter3;
mod chapter4;
mod chapter5;
mod characteristic;
mod circle;
mod circle_figures;
mod circle_tests;
mod commission;
mod comparison;
mod design_npid;
mod design_pid;
mod friction;
mod friction_models;
mod identify;
mod laws;
mod loop_figures;
mod motion;
mod motor_constant;
mod numbering;
mod numerics;
mod outputs;
mod part_program;
mod recorded;
mod revise;
mod robustness;
mod robustness_figures;
mod validation;
mod wrong_model;

pub use chapter3::chapter3_sections;
pub use chapter4::{chapter4_sections, data_section};
pub use chapter5::{chapter5_sections, headline_section, study_section};
pub use characteristic::{characteristic_section, characteristic_table};
pub use circle_tests::{circle_page, circle_sections, circle_tables};
pub use commission::{commission_page, gains_table, verdict_table};
pub use comparison::{comparison_page, comparison_tables};
pub use design_npid::NonlinearPage;
pub use design_pid::{PidPage, margins_table, pid_table, step_table};
pub use friction::{friction_section, friction_table, gms_table, presliding_section};
pub use friction_models::{
    friction_models_page, friction_models_sections, friction_models_table,
    friction_parameters_table, tracking_table,
};
pub use identify::{fitted_response_section, motor_constant_table, plant_tables, response_section};
pub use laws::{laws_section, laws_table, tuning_table};
pub use motion::{Reruns, candidates_table, motion_page, motion_table};
pub use motor_constant::motor_constant_section;
pub use numerics::numerics_table;
pub use outputs::outputs_table;
pub use part_program::{motion_summary_table, program_page, program_table};
pub use recorded::{recorded_page, recorded_table};
pub use revise::{AmplitudeResponse, revise_page, revise_table};
pub use robustness::{robustness_full_table, robustness_sections, robustness_tables};
pub use validation::validation_table;
pub use wrong_model::wrong_model_section;

use crate::experiment::statistic::Statistic;
use crate::report::{Cell, Provenance, Series, Spread, Style};

/// mm to um.
const UM_PER_MM: f64 = 1e3;

/// How a page came about: the command line as a reader would repeat it, the seed, this program's version.
pub fn provenance(command: &str, seed: u64) -> Provenance {
    Provenance {
        command: command.to_owned(),
        seed: Some(seed),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// Mean and deviation as cells, in the unit that `scale` makes; missing where there is none.
fn statistic_cells(statistic: Option<Statistic>, scale: f64, decimals: usize) -> [Cell; 2] {
    let cell = |value: Option<f64>| {
        value.map_or(Cell::Missing, |value| Cell::number(scale * value, decimals))
    };
    [
        cell(statistic.map(|found| found.mean)),
        cell(statistic.and_then(|found| found.deviation)),
    ]
}

/// A dot at the mean with a bar over one deviation to each side, in the unit that `scale` makes.
fn dot(statistic: Statistic, scale: f64) -> Spread {
    let (low, high) = statistic.range();
    Spread {
        mean: scale * statistic.mean,
        low: scale * low,
        high: scale * high,
    }
}

/// An error in mm over time, as a curve in um; samples are `period_s` apart.
fn error_curve(name: String, error_mm: &[f64], period_s: f64, style: Style) -> Series {
    Series {
        name,
        x: (0..error_mm.len()).map(|k| k as f64 * period_s).collect(),
        y: error_mm.iter().map(|error| error * UM_PER_MM).collect(),
        style,
    }
}
