//! The fit, its validation and its errors.

use nalgebra::{DMatrix, DVector};
use quadrant::friction::PerDirection;
use rayon::prelude::*;

use super::model::{Estimate, MotionModel, Structure, sliding};
use super::regressors::{Regression, Term, Way, solve};
use super::signals::{MotionFitSettings, Signals};
use crate::identify::fit::{FitError, Loss, Parameter, fit};
use crate::rig::Recording;

/// A model, and how it does where it was not fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The model, fitted to the whole record.
    pub model: MotionModel,
    /// Relative error of models fitted to every other pair of motion segments on the pairs between, both ways round;
    /// nothing when there are too few segments.
    pub validation_error: Option<f64>,
    /// The rows of the regression.
    pub rows: Rows,
}

/// What a fit explains, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Velocity, mm/s.
    pub velocity_mm_s: Vec<f64>,
    /// Voltage that was commanded a dead time before, V.
    pub voltage_v: Vec<f64>,
    /// What the model leaves unexplained of it, V.
    pub residual_v: Vec<f64>,
    /// Voltage without inertia and offset, V: the friction.
    pub friction_v: Vec<f64>,
}

/// Why a record yields no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionFitError {
    /// A setting that cannot be.
    #[error("{field} = {value}: {expected}")]
    Setting {
        /// Which.
        field: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Too short.
    #[error(
        "{rows} rows are left of the record, and a fit takes {LEAST_ROWS}: record longer, raise the row rate, or cut less at the edges"
    )]
    TooShort {
        /// Rows left.
        rows: usize,
    },
    /// It moves one way only.
    #[error(
        "only {percent:.1} % of the record moves in one of the directions: friction and offset cannot be told apart without motion both \
         ways, {LEAST_PERCENT} % at least"
    )]
    OneWay {
        /// The smaller share.
        percent: f64,
    },
    /// It holds too little of something.
    #[error(
        "the record does not tell the parameters of \"{structure}\" apart: it needs several velocities, accelerations and reversals"
    )]
    Dependent {
        /// The model.
        structure: String,
    },
    /// The fit makes no sense of mass or friction.
    #[error(
        "the fit of \"{structure}\" gives {name} = {value:.4} {unit}: are position and voltage of the same axis, and the voltage positive \
         towards larger positions?"
    )]
    Unphysical {
        /// The model.
        structure: String,
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The search failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Fewest rows.
const LEAST_ROWS: usize = 200;
/// Share of the rows that must move each way, %.
const LEAST_PERCENT: f64 = 5.0;
/// Largest dead time, s.
const MOST_DEAD_TIME_S: f64 = 0.02;
/// Stribeck velocity over the largest velocity: start and bounds of the search.
const STRIBECK: (f64, f64, f64) = (0.1, 2e-3, 0.7);
/// Share of the largest velocity below which the axis does not count as moving.
const MOVING: f64 = 0.01;
/// Blocks that standard errors are taken over.
const BLOCKS: usize = 40;
/// Share by which a parameter is shifted for a difference quotient.
const SHIFT: f64 = 1e-3;
/// Time by which the dead time is shifted for one, s.
const DEAD_TIME_SHIFT_S: f64 = 1e-4;

/// Fits every structure of [`Structure::ALL`] to a record; `progress` is told the share that is done.
///
/// # Errors
/// A record that is too short, moves one way only, or does not tell parameters apart.
pub fn fit_motion(
    recording: &Recording,
    settings: &MotionFitSettings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Candidate>, MotionFitError> {
    check(recording, settings)?;
    let signals = Signals::new(recording, settings);
    let velocity = signals.decimated(&signals.velocity_mm_s, settings);
    let segments = segments(&velocity)?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    Structure::ALL
        .into_par_iter()
        .map(|structure| {
            let candidate = candidate(&signals, settings, structure, &segments);
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            progress(count as f64 / Structure::ALL.len() as f64);
            candidate
        })
        .collect()
}

fn check(recording: &Recording, settings: &MotionFitSettings) -> Result<(), MotionFitError> {
    let refuse = |field, value, expected| {
        Err(MotionFitError::Setting {
            field,
            value,
            expected,
        })
    };
    let half_rate_hz = 0.5 / recording.sample_time_s;
    if !(settings.cutoff_hz > 0.0 && settings.cutoff_hz < 0.9 * half_rate_hz) {
        let expected = "it must be above zero and below 0.45 of the record's sampling rate, in Hz";
        return refuse("cut-off", settings.cutoff_hz, expected);
    }
    if !(settings.edge_s >= 0.0 && settings.edge_s <= 100.0) {
        return refuse("cut edges", settings.edge_s, "they must be 0 to 100 s");
    }
    if !(settings.row_rate_hz >= 1.0 && settings.row_rate_hz <= 2.0 * half_rate_hz) {
        let expected = "it must be 1 Hz to the record's sampling rate";
        return refuse("row rate", settings.row_rate_hz, expected);
    }
    let ascending = settings.knots_mm.windows(2).all(|pair| pair[0] < pair[1]);
    let within = settings
        .knots_mm
        .iter()
        .all(|knot| (1e-6..=10.0).contains(knot));
    if settings.knots_mm.is_empty() || settings.knots_mm.len() > 8 || !(ascending && within) {
        let expected = "there must be 1 to 8 knots, ascending, of 0.000001 to 10 mm";
        return refuse("knots", settings.knots_mm.len() as f64, expected);
    }
    let period_s = recording.sample_time_s;
    let left = recording
        .len()
        .saturating_sub(2 * settings.edge_samples(period_s));
    let rows = left / settings.decimation(period_s);
    if rows < LEAST_ROWS {
        return Err(MotionFitError::TooShort { rows });
    }
    Ok(())
}

/// The motion segment that each row belongs to: from reversal to reversal.
fn segments(velocity_mm_s: &[f64]) -> Result<Vec<usize>, MotionFitError> {
    let largest = velocity_mm_s
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    let moving = MOVING * largest;
    let share = |sign: f64| {
        let count = velocity_mm_s.iter().filter(|v| **v * sign > moving).count();
        100.0 * count as f64 / velocity_mm_s.len() as f64
    };
    let percent = share(1.0).min(share(-1.0));
    if percent < LEAST_PERCENT {
        return Err(MotionFitError::OneWay { percent });
    }
    let (mut segment, mut way) = (0, 0.0);
    Ok(velocity_mm_s
        .iter()
        .map(|velocity| {
            if velocity.abs() > moving {
                if way * velocity < 0.0 {
                    segment += 1;
                }
                way = velocity.signum();
            }
            segment
        })
        .collect())
}

fn candidate(
    signals: &Signals,
    settings: &MotionFitSettings,
    structure: Structure,
    segments: &[usize],
) -> Result<Candidate, MotionFitError> {
    let regression = Regression::new(signals, settings, structure);
    let all: Vec<usize> = (0..regression.rows()).collect();
    let whole = Solution::find(&regression, structure, &all)?;
    let residual = whole.residual(&regression, &all);
    let row_s = signals.sample_time_s * settings.decimation(signals.sample_time_s) as f64;
    let model = whole.model(&regression, structure, settings, &residual)?;
    let acceleration = signals.decimated(&signals.acceleration_mm_s2, settings);
    let voltage = regression.voltage_at(whole.dead_time_s);
    let friction = voltage
        .iter()
        .zip(&acceleration)
        .map(|(volts, a)| volts - model.inertia_v_s2_per_mm * a - model.offset_v);
    Ok(Candidate {
        validation_error: validation(&regression, structure, segments)?,
        rows: Rows {
            time_s: all
                .iter()
                .map(|row| settings.edge_s + *row as f64 * row_s)
                .collect(),
            velocity_mm_s: regression.velocity_mm_s.clone(),
            friction_v: friction.collect(),
            voltage_v: voltage.iter().copied().collect(),
            residual_v: residual.iter().copied().collect(),
        },
        model,
    })
}

/// The model to use: that with the smallest error where it was not fitted (or, without validation, where it was), among
/// those whose level does not rise with the velocity.
pub fn recommended(candidates: &[Candidate]) -> Option<&Candidate> {
    let error = |candidate: &Candidate| {
        candidate
            .validation_error
            .unwrap_or(candidate.model.relative_error)
    };
    candidates
        .iter()
        .filter(|candidate| candidate.model.is_stribeck())
        .min_by(|a, b| error(a).total_cmp(&error(b)))
}

/// Fits one half of the pairs of segments and judges the other, both ways round.
fn validation(
    regression: &Regression<'_>,
    structure: Structure,
    segments: &[usize],
) -> Result<Option<f64>, MotionFitError> {
    // A pair holds both senses of motion, so that either half can be fitted by itself.
    let half = |parity: usize| -> Vec<usize> {
        (0..segments.len())
            .filter(|&row| segments[row] / 2 % 2 == parity)
            .collect()
    };
    if segments.last().is_none_or(|last| *last < 3) {
        return Ok(None);
    }
    let (mut missed, mut total) = (0.0, 0.0);
    for parity in [0, 1] {
        let found = Solution::find(regression, structure, &half(parity))?;
        let others = half(1 - parity);
        missed += found.residual(regression, &others).norm_squared();
        let voltage = regression.voltage_at(found.dead_time_s);
        total += voltage.select_rows(&others).norm_squared();
    }
    Ok(Some((missed / total).sqrt()))
}

/// The parameters of one fit.
struct Solution {
    coefficients: DVector<f64>,
    dead_time_s: f64,
    stribeck_velocity_mm_s: f64,
}

impl Solution {
    /// The two parameters that are not linear are searched for; the others follow from them.
    fn find(
        regression: &Regression<'_>,
        structure: Structure,
        rows: &[usize],
    ) -> Result<Self, MotionFitError> {
        let fastest = regression
            .velocity_mm_s
            .iter()
            .fold(0.0_f64, |most, v| most.max(v.abs()));
        let (start, low, high) = STRIBECK;
        let mut searched = Vec::new();
        let known_s = regression
            .known_dead_time_s()
            .filter(|_| structure.dead_time);
        if structure.dead_time && known_s.is_none() {
            searched.push(Parameter {
                name: "dead time",
                start: 1e-3,
                bounds: (0.0, MOST_DEAD_TIME_S),
            });
        }
        if structure.stribeck {
            searched.push(Parameter {
                name: "Stribeck velocity",
                start: start * fastest,
                bounds: (low * fastest, high * fastest),
            });
        }
        let split = |values: &[f64]| {
            let dead_time_s = match known_s {
                Some(known_s) => known_s,
                None if structure.dead_time => values[0],
                None => 0.0,
            };
            let velocity = values.last().copied().filter(|_| structure.stribeck);
            (dead_time_s, velocity.unwrap_or(start * fastest))
        };
        let solved = |values: &[f64]| {
            let (dead_time_s, stribeck_velocity_mm_s) = split(values);
            let columns = regression.columns_at(stribeck_velocity_mm_s);
            let voltage = regression.voltage_at(dead_time_s);
            solve(&regression.terms, &columns, &voltage, rows).map(|coefficients| Self {
                coefficients,
                dead_time_s,
                stribeck_velocity_mm_s,
            })
        };
        let dependent = || MotionFitError::Dependent {
            structure: structure.name(),
        };
        let start: Vec<f64> = searched.iter().map(|parameter| parameter.start).collect();
        solved(&start).ok_or_else(dependent)?;
        if searched.is_empty() {
            return solved(&[]).ok_or_else(dependent);
        }
        let found = fit(&searched, Loss::Squares, |values| {
            solved(values).map_or_else(
                || vec![f64::NAN; rows.len()],
                |solution| solution.residual(regression, rows).as_slice().to_vec(),
            )
        })?;
        solved(&found.values).ok_or_else(dependent)
    }

    fn residual(&self, regression: &Regression<'_>, rows: &[usize]) -> DVector<f64> {
        let columns = regression.columns_at(self.stribeck_velocity_mm_s);
        let voltage = regression.voltage_at(self.dead_time_s);
        (voltage - columns * &self.coefficients).select_rows(rows)
    }

    /// The model, in its own terms.
    fn model(
        &self,
        regression: &Regression<'_>,
        structure: Structure,
        settings: &MotionFitSettings,
        residual: &DVector<f64>,
    ) -> Result<MotionModel, MotionFitError> {
        let sum = |wanted: &dyn Fn(Term) -> bool| -> f64 {
            let terms = regression.terms.iter().zip(self.coefficients.iter());
            terms
                .filter(|(term, _)| wanted(**term))
                .map(|(_, value)| value)
                .sum()
        };
        let inertia = sum(&|term| term == Term::Inertia);
        let coulomb = sum(&|term| matches!(term, Term::Coulomb | Term::Element(_)));
        let drop = sum(&|term| term == Term::Drop);
        let viscous =
            |way: Way| sum(&|term| term == Term::Viscous(way) || term == Term::Viscous(Way::Both));
        let way = |way: Way| {
            sliding(
                coulomb,
                drop,
                self.stribeck_velocity_mm_s,
                viscous(way).max(0.0),
            )
        };
        for (name, value, unit) in [("M'", inertia, "V s²/mm"), ("Fc", coulomb, "V")] {
            if value <= 0.0 {
                return Err(MotionFitError::Unphysical {
                    structure: structure.name(),
                    name: name.to_owned(),
                    value,
                    unit,
                });
            }
        }
        let elements = regression.terms.iter().zip(self.coefficients.iter());
        let elements = elements.filter_map(|(term, level_v)| match term {
            Term::Element(knot) if *level_v > 0.0 => Some((settings.knots_mm[*knot], *level_v)),
            _ => None,
        });
        let voltage = regression.voltage_at(self.dead_time_s);
        Ok(MotionModel {
            structure,
            inertia_v_s2_per_mm: inertia,
            friction: PerDirection {
                positive: way(Way::Positive),
                negative: way(Way::Negative),
            },
            offset_v: sum(&|term| term == Term::Offset),
            dead_time_s: self.dead_time_s,
            hold_s: regression.hold_s(),
            elements: elements.collect(),
            estimates: self.estimates(regression, structure, settings, residual),
            relative_error: residual.norm() / voltage.norm(),
        })
    }

    /// Every parameter with its standard error: the residuals of neighbouring rows are correlated, so that scores are summed
    /// over blocks before they are taken for independent (the sandwich of Huber, 1967, and White, 1980).
    fn estimates(
        &self,
        regression: &Regression<'_>,
        structure: Structure,
        settings: &MotionFitSettings,
        residual: &DVector<f64>,
    ) -> Vec<Estimate> {
        let columns = regression.columns_at(self.stribeck_velocity_mm_s);
        let mut estimates: Vec<Estimate> = regression
            .terms
            .iter()
            .zip(self.coefficients.iter())
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
            let later = regression.voltage_at(self.dead_time_s + shift);
            let sooner = regression.voltage_at((self.dead_time_s - shift).max(0.0));
            let step = shift + shift.min(self.dead_time_s);
            jacobian.push((sooner - later) / step);
            estimates.push(searched("Td", "s", self.dead_time_s, (1.0, "s")));
        }
        if structure.stribeck {
            let shift = SHIFT * self.stribeck_velocity_mm_s;
            let above = regression.columns_at(self.stribeck_velocity_mm_s + shift);
            let below = regression.columns_at(self.stribeck_velocity_mm_s - shift);
            jacobian.push((above - below) * &self.coefficients / (2.0 * shift));
            let velocity = self.stribeck_velocity_mm_s;
            estimates.push(searched("Vs", "mm/s", velocity, (1e-3, "m/s")));
        }
        // A level that is left out is no parameter.
        let free: Vec<usize> = (0..estimates.len())
            .filter(|&i| estimates[i].value != 0.0)
            .collect();
        let kept: Vec<DVector<f64>> = free.iter().map(|&i| jacobian[i].clone()).collect();
        for (place, error) in sandwich(&DMatrix::from_columns(&kept), residual) {
            estimates[free[place]].standard_error = error;
        }
        estimates.retain(|estimate| estimate.value != 0.0);
        estimates
    }
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
    };
    Estimate {
        name,
        unit,
        value,
        standard_error: f64::INFINITY,
        to_si,
    }
}
