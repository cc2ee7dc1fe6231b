//! Bounded, robust nonlinear least squares, with standard errors and correlations.
//!
//! Levenberg-Marquardt does the minimisation; bounds are met by MINUIT's sine transformation, outliers by reweighting
//! with Huber's weights (Huber and Ronchetti, *Robust Statistics*, 2nd ed., 2009). Standard errors come from the
//! Jacobian at the optimum: they hold for independent residuals; a caller with correlated ones thins or whitens them first.

use std::fmt;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

/// A parameter to be fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its name in messages and tables.
    pub name: &'static str,
    /// Start of the search; within the bounds.
    pub start: f64,
    /// Smallest and largest value, both finite.
    pub bounds: (f64, f64),
}

/// Loss function: the weight of residuals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    #[default]
    Squares,
    /// By their squares up to 1.345 standard deviations, by their magnitudes beyond: 95 % as efficient on normal noise.
    Huber,
}

/// Result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Names, as given.
    pub names: Vec<&'static str>,
    /// Values, in the order given.
    pub values: Vec<f64>,
    /// One standard deviation of each value; infinite when the data do not determine it.
    pub standard_errors: Vec<f64>,
    /// Correlation of the values' errors.
    pub correlation: DMatrix<f64>,
    /// RMS of the residuals at the optimum, corrected for the number of parameters.
    pub residual_rms: f64,
    /// True for values that ended at a bound: their standard errors mean nothing.
    pub at_bound: Vec<bool>,
}

impl Fit {
    /// The same with standard errors no smaller than the stated deviations of the residuals allow; for residuals that
    /// are divided by their deviations. A fit that is better than that was lucky, or the deviations hold an error that does
    /// not scatter.
    #[must_use]
    pub fn no_better_than_stated(mut self) -> Self {
        let factor = self.residual_rms.recip().max(1.0);
        self.standard_errors
            .iter_mut()
            .for_each(|error| *error *= factor);
        self
    }

    /// The covariance of two values' errors.
    pub fn covariance(&self, row: usize, column: usize) -> f64 {
        self.correlation[(row, column)] * self.standard_errors[row] * self.standard_errors[column]
    }
}

/// Reasons for which a fit fails.
#[derive(Clone, Debug, PartialEq)]
pub enum FitError {
    /// Fewer residuals than parameters.
    TooFewData { residuals: usize, parameters: usize },
    /// A start outside its bounds, or bounds that are not finite.
    BadStart { parameter: &'static str },
    /// A residual is not a number at the start.
    NotFinite,
    /// The search did not come to an end.
    NotConverged,
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewData {
                residuals,
                parameters,
            } => write!(
                f,
                "{residuals} data points cannot determine {parameters} parameters"
            ),
            Self::BadStart { parameter } => {
                write!(f, "the start of {parameter} is not within its bounds")
            }
            Self::NotFinite => write!(f, "the model gives no number at the start of the search"),
            Self::NotConverged => write!(f, "the search for the parameters did not converge"),
        }
    }
}

impl std::error::Error for FitError {}

/// Rounds of reweighting at most.
const ROUNDS: usize = 30;
/// Huber's constant, in standard deviations.
const HUBER: f64 = 1.345;
/// Step of the difference quotients for smooth residuals, of a parameter's range or magnitude.
const STEP: f64 = 1e-6;
/// Distance to a bound, of the range, at which a value counts as lying on it.
const ON_BOUND: f64 = 1e-6;

/// Minimises the residuals' squares, or Huber's loss, over the parameters within their bounds. `residuals` gives as many
/// numbers at every call.
///
/// # Errors
/// Too few residuals, a start outside the bounds, a model that is not finite there, or no convergence.
pub fn fit(
    parameters: &[Parameter],
    loss: Loss,
    residuals: impl Fn(&[f64]) -> Vec<f64> + Sync,
) -> Result<Fit, FitError> {
    fit_with_step(parameters, loss, STEP, residuals)
}

/// As [`fit`], for residuals that are rough on a small scale, such as those of a simulated encoder: `step` is that of the
/// difference quotients, of a parameter's range or magnitude.
///
/// # Errors
/// As [`fit`].
pub fn fit_with_step(
    parameters: &[Parameter],
    loss: Loss,
    step: f64,
    residuals: impl Fn(&[f64]) -> Vec<f64> + Sync,
) -> Result<Fit, FitError> {
    search(parameters, loss, (step, step > STEP), residuals)
}

/// As [`fit`], but where the search stands when its patience is out will do: for the start of another, or for what is judged otherwise.
///
/// # Errors
/// As [`fit`], but for the last.
pub fn fit_nearest(
    parameters: &[Parameter],
    loss: Loss,
    residuals: impl Fn(&[f64]) -> Vec<f64> + Sync,
) -> Result<Fit, FitError> {
    search(parameters, loss, (STEP, true), residuals)
}

/// The search; its step, and whether it may end without having converged.
fn search(
    parameters: &[Parameter],
    loss: Loss,
    (step, nearest): (f64, bool),
    residuals: impl Fn(&[f64]) -> Vec<f64> + Sync,
) -> Result<Fit, FitError> {
    for parameter in parameters {
        let (low, high) = parameter.bounds;
        let within = low < high && (low..=high).contains(&parameter.start);
        if !(within && low.is_finite() && high.is_finite()) {
            return Err(FitError::BadStart {
                parameter: parameter.name,
            });
        }
    }
    let start: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    let first = residuals(&start);
    if first.len() <= parameters.len() {
        return Err(FitError::TooFewData {
            residuals: first.len(),
            parameters: parameters.len(),
        });
    }
    if first.iter().any(|residual| !residual.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let mut problem = Problem {
        parameters,
        residuals: &residuals,
        step,
        nearest,
        angles: DVector::from_iterator(parameters.len(), parameters.iter().map(angle)),
        weights: vec![1.0; first.len()],
    };
    problem = problem.minimise()?;
    if loss == Loss::Huber {
        for _ in 0..ROUNDS {
            let before = problem.values();
            problem.reweigh();
            problem = problem.minimise()?;
            if settled(parameters, &before, &problem.values()) {
                break;
            }
        }
    }
    Ok(problem.summary())
}

/// True if no value moved by more than a millionth of its range between two rounds.
fn settled(parameters: &[Parameter], before: &[f64], after: &[f64]) -> bool {
    parameters
        .iter()
        .zip(before.iter().zip(after))
        .all(|(p, (a, b))| (a - b).abs() <= 1e-6 * b.abs().max(1e-6 * (p.bounds.1 - p.bounds.0)))
}

/// The unbounded variable that stands for a parameter: `p = low + (high - low) (1 + sin angle) / 2`.
fn angle(parameter: &Parameter) -> f64 {
    let (low, high) = parameter.bounds;
    // At a bound the sine is flat and nothing would move.
    let share = ((parameter.start - low) / (high - low)).clamp(1e-9, 1.0 - 1e-9);
    (2.0 * share - 1.0).asin()
}

struct Problem<'a, F> {
    parameters: &'a [Parameter],
    residuals: &'a F,
    step: f64,
    /// True if the search may end without having converged.
    nearest: bool,
    angles: DVector<f64>,
    /// Square roots of the residuals' weights.
    weights: Vec<f64>,
}

impl<'a, F: Fn(&[f64]) -> Vec<f64> + Sync> Problem<'a, F> {
    fn value(parameter: &Parameter, angle: f64) -> f64 {
        let (low, high) = parameter.bounds;
        low + (high - low) * 0.5 * (1.0 + angle.sin())
    }

    fn values(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .zip(self.angles.iter())
            .map(|(parameter, &angle)| Self::value(parameter, angle))
            .collect()
    }

    fn minimise(self) -> Result<Self, FitError> {
        let nearest = self.nearest;
        let patience = if self.step > STEP { 30 } else { 200 };
        let (problem, report) = LevenbergMarquardt::new()
            .with_patience(patience)
            .minimize(self);
        // A gradient lost in the difference quotients' rounding, or in the roughness of the residuals, is as near as
        // this gets.
        let done = match report.termination {
            TerminationReason::NoImprovementPossible(_) => true,
            TerminationReason::LostPatience => nearest,
            reason => reason.was_successful(),
        };
        done.then_some(problem).ok_or(FitError::NotConverged)
    }

    /// Huber's weights, on a scale from the median of the magnitudes.
    fn reweigh(&mut self) {
        let residuals = (self.residuals)(&self.values());
        let mut magnitudes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
        magnitudes.sort_by(f64::total_cmp);
        let scale = 1.4826 * magnitudes[magnitudes.len() / 2];
        for (weight, residual) in self.weights.iter_mut().zip(residuals) {
            let far = residual.abs() / (HUBER * scale);
            *weight = if far > 1.0 { far.recip().sqrt() } else { 1.0 };
        }
    }

    fn weighted(&self, values: &[f64]) -> DVector<f64> {
        let residuals = (self.residuals)(values);
        DVector::from_iterator(
            residuals.len(),
            residuals.iter().zip(&self.weights).map(|(r, w)| r * w),
        )
    }

    /// Derivatives of the weighted residuals by central differences. `place` turns a step of a variable into values.
    fn differences(
        &self,
        at: &[f64],
        steps: &[f64],
        place: impl Fn(&[f64]) -> Vec<f64> + Sync,
    ) -> DMatrix<f64> {
        let column = |(index, &step): (usize, &f64)| {
            let moved = |by: f64| {
                let mut there = at.to_vec();
                there[index] += by;
                self.weighted(&place(&there))
            };
            (moved(step) - moved(-step)) / (2.0 * step)
        };
        // Rough residuals are simulations, each of which takes longer than handing it to another thread.
        let columns: Vec<DVector<f64>> = if self.step > STEP {
            steps.par_iter().enumerate().map(column).collect()
        } else {
            steps.iter().enumerate().map(column).collect()
        };
        DMatrix::from_columns(&columns)
    }

    fn summary(&self) -> Fit {
        let values = self.values();
        let count = values.len();
        let weighted = self.weighted(&values);
        let freedom = (weighted.len() - count) as f64;
        let variance = weighted.norm_squared() / freedom;
        let range = |p: &Parameter| p.bounds.1 - p.bounds.0;
        let steps: Vec<f64> = self
            .parameters
            .iter()
            .zip(&values)
            .map(|(p, value)| self.step * value.abs().max(1e-3 * range(p)))
            .collect();
        let at_bound: Vec<bool> = self
            .parameters
            .iter()
            .zip(&values)
            .map(|(p, value)| {
                let margin = ON_BOUND * range(p);
                value - p.bounds.0 < margin || p.bounds.1 - value < margin
            })
            .collect();
        // In units of each parameter's step the normal matrix is well scaled.
        let mut jacobian = self.differences(&values, &steps, <[f64]>::to_vec);
        for (mut column, step) in jacobian.column_iter_mut().zip(&steps) {
            column *= *step;
        }
        let normal = jacobian.transpose() * &jacobian;
        // A value without any influence is unknown; the others are determined as well as without it.
        let acting: Vec<usize> = (0..count).filter(|&i| normal[(i, i)] > 0.0).collect();
        let part = normal.select_rows(&acting).select_columns(&acting);
        let mut inverse = DMatrix::from_diagonal_element(count, count, f64::INFINITY);
        if let Some(found) = part.try_inverse() {
            for (row, &of) in acting.iter().enumerate() {
                for (column, &other) in acting.iter().enumerate() {
                    inverse[(of, other)] = found[(row, column)];
                }
            }
        }
        // No variance is zero or less but by rounding, of an inverse that has lost its digits.
        let deviation = |index: usize| match inverse[(index, index)] {
            variance if variance > 0.0 => variance.sqrt(),
            _ => f64::INFINITY,
        };
        Fit {
            names: self.parameters.iter().map(|p| p.name).collect(),
            standard_errors: (0..count)
                .map(|index| match deviation(index) {
                    f64::INFINITY => f64::INFINITY,
                    deviation => variance.sqrt() * deviation * steps[index],
                })
                .collect(),
            correlation: DMatrix::from_fn(count, count, |row, column| {
                if row == column {
                    1.0
                } else {
                    inverse[(row, column)] / (deviation(row) * deviation(column))
                }
            }),
            residual_rms: variance.sqrt(),
            at_bound,
            values,
        }
    }
}

impl<F: Fn(&[f64]) -> Vec<f64> + Sync> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_, F> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, angles: &DVector<f64>) {
        self.angles.copy_from(angles);
    }

    fn params(&self) -> DVector<f64> {
        self.angles.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let residuals = self.weighted(&self.values());
        residuals.iter().all(|r| r.is_finite()).then_some(residuals)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let place = |angles: &[f64]| {
            self.parameters
                .iter()
                .zip(angles)
                .map(|(parameter, &angle)| Self::value(parameter, angle))
                .collect()
        };
        let steps = vec![self.step; self.angles.len()];
        let jacobian = self.differences(self.angles.as_slice(), &steps, place);
        jacobian.iter().all(|d| d.is_finite()).then_some(jacobian)
    }
}

#[cfg(test)]
mod tests;
