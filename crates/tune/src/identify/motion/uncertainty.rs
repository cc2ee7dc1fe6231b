//! Standard errors of a fit.

use nalgebra::{DMatrix, DVector};

use super::model::{Estimate, Structure};
use super::regressors::{Regression, Term, Way};
use super::signals::MotionFitSettings;
use super::solution::Solution;

/// Name of the dead time.
const DEAD_TIME: &str = "Td";
/// Name of the Stribeck velocity.
const STRIBECK_VELOCITY: &str = "Vs";
/// Number of blocks from which standard errors are computed.
const BLOCKS: usize = 40;
/// Share by which a parameter is shifted for a difference quotient.
const SHIFT: f64 = 1e-3;
/// Time by which the dead time is shifted for one, s.
const DEAD_TIME_SHIFT_S: f64 = 1e-4;

/// Every parameter with its standard error, the larger of two. One is for noise: the residuals of neighbouring rows are
/// correlated, so that scores are summed over blocks before they are taken for independent (the sandwich of Huber, 1967, and
/// White, 1980). The other is for what the model leaves out: the jackknife over `withheld`, the same fit with one part of the
/// trajectory withheld at a time.
pub(super) fn estimates(
    solution: &Solution,
    regression: &Regression<'_>,
    structure: Structure,
    settings: &MotionFitSettings,
    residual: &DVector<f64>,
    withheld: &[Solution],
) -> Vec<Estimate> {
    let columns = regression.columns_at(solution.stribeck_velocity_mm_s);
    let mut estimates: Vec<Estimate> = regression
        .terms
        .iter()
        .zip(solution.coefficients.iter())
        .map(|(term, &value)| described(*term, settings, value))
        .collect();
    let mut jacobian: Vec<DVector<f64>> = columns
        .column_iter()
        .map(|column| column.into_owned())
        .collect();
    let searched = |name: &str, unit, value: f64, to_si| Estimate {
        name: name.to_owned(),
        unit,
        value,
        standard_error: f64::INFINITY,
        to_si,
    };
    if structure.dead_time && settings.dead_time_s.is_none() {
        let shift = DEAD_TIME_SHIFT_S;
        let later = regression.voltage_at(solution.dead_time_s + shift);
        let sooner = regression.voltage_at((solution.dead_time_s - shift).max(0.0));
        let step = shift + shift.min(solution.dead_time_s);
        jacobian.push((sooner - later) / step);
        estimates.push(searched(DEAD_TIME, "s", solution.dead_time_s, (1.0, "s")));
    }
    if structure.stribeck {
        let shift = SHIFT * solution.stribeck_velocity_mm_s;
        let above = regression.columns_at(solution.stribeck_velocity_mm_s + shift);
        let below = regression.columns_at(solution.stribeck_velocity_mm_s - shift);
        jacobian.push((&*above - &*below) * &solution.coefficients / (2.0 * shift));
        let velocity = solution.stribeck_velocity_mm_s;
        estimates.push(searched(STRIBECK_VELOCITY, "mm/s", velocity, (1e-3, "m/s")));
    }
    // A level that is left out is no parameter.
    let free: Vec<usize> = (0..estimates.len())
        .filter(|&i| estimates[i].value != 0.0)
        .collect();
    let kept: Vec<DVector<f64>> = free.iter().map(|&i| jacobian[i].clone()).collect();
    for (place, error) in sandwich(&DMatrix::from_columns(&kept), residual) {
        let index = free[place];
        let values: Vec<f64> = withheld
            .iter()
            .map(|other| match estimates[index].name.as_str() {
                DEAD_TIME => other.dead_time_s,
                STRIBECK_VELOCITY => other.stribeck_velocity_mm_s,
                _ => other.coefficients[index],
            })
            .collect();
        estimates[index].standard_error = error.max(jackknife(&values));
    }
    estimates.retain(|estimate| estimate.value != 0.0);
    estimates
}

/// Standard error of a value from what it becomes when one part of the data is withheld at a time; zero without such values.
fn jackknife(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares * (count - 1.0) / count).sqrt()
}

/// Standard errors from sums over blocks, place by place; none where the columns depend on each other.
fn sandwich(jacobian: &DMatrix<f64>, residual: &DVector<f64>) -> Vec<(usize, f64)> {
    let Some(bread) = (jacobian.transpose() * jacobian).try_inverse() else {
        return Vec::new();
    };
    let rows = jacobian.nrows();
    let length = rows.div_ceil(BLOCKS);
    let mut filling = DMatrix::zeros(jacobian.ncols(), jacobian.ncols());
    for start in (0..rows).step_by(length) {
        let count = length.min(rows - start);
        let score = jacobian.rows(start, count).transpose() * residual.rows(start, count);
        filling += &score * score.transpose();
    }
    let blocks = rows.div_ceil(length) as f64;
    let freedom = blocks / (blocks - 1.0);
    let covariance = &bread * filling * &bread * freedom;
    let errors = covariance.diagonal();
    errors
        .iter()
        .map(|variance| variance.sqrt())
        .enumerate()
        .collect()
}

/// A linear term as a table shows it.
fn described(term: Term, settings: &MotionFitSettings, value: f64) -> Estimate {
    let (name, unit, to_si) = match term {
        Term::Inertia => ("M'".to_owned(), "V s²/mm", (1e3, "kg")),
        Term::Viscous(Way::Both) => ("sigma".to_owned(), "V s/mm", (1e3, "N s/m")),
        Term::Viscous(Way::Positive) => ("sigma, positive".to_owned(), "V s/mm", (1e3, "N s/m")),
        Term::Viscous(Way::Negative) => ("sigma, negative".to_owned(), "V s/mm", (1e3, "N s/m")),
        Term::Coulomb => ("Fc".to_owned(), "V", (1.0, "N")),
        Term::Element(knot) => {
            let um = 1e3 * settings.knots_mm[knot];
            (format!("level of the element at {um} um"), "V", (1.0, "N"))
        }
        Term::Drop => ("Fs - Fc".to_owned(), "V", (1.0, "N")),
        Term::Offset => ("offset".to_owned(), "V", (1.0, "N")),
        Term::Drift(part) => (format!("drift of the {}", part.name()), "V", (1.0, "N")),
        Term::AlongTravel(part) => (
            format!("{} along half of the travel", part.name()),
            "V",
            (1.0, "N"),
        ),
    };
    Estimate {
        name,
        unit,
        value,
        standard_error: f64::INFINITY,
        to_si,
    }
}
