//! One fit: the parameters that are not linear are searched for, the others follow.

use nalgebra::DVector;
use quadrant_law::friction::PerDirection;

use super::error::MotionFitError;
use super::model::{Change, Estimate, MotionModel, Structure, sliding};
use super::regressors::{Part, Regression, Solver, Term, Way};
use super::signals::MotionFitSettings;
use crate::identify::fit::{Loss, Parameter, fit_nearest};

/// Largest dead time, s.
pub(super) const MOST_DEAD_TIME_S: f64 = 0.02;
/// Stribeck velocity over the largest velocity: start and bounds of the search.
const STRIBECK: (f64, f64, f64) = (0.1, 2e-3, 0.7);

/// The parameters of one fit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Solution {
    pub(super) coefficients: DVector<f64>,
    pub(super) dead_time_s: f64,
    pub(super) stribeck_velocity_mm_s: f64,
}

impl Solution {
    /// The two parameters that are not linear are searched for; the others follow from them.
    pub(super) fn find(
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
                // A held voltage is late by half its hold, on every axis.
                None if structure.sliding => regression.hold_s(),
                None => 0.0,
            };
            let velocity = values.last().copied().filter(|_| structure.stribeck);
            (dead_time_s, velocity.unwrap_or(start * fastest))
        };
        let solver = Solver::new(&regression.terms, rows);
        let solved = |values: &[f64]| {
            let (dead_time_s, stribeck_velocity_mm_s) = split(values);
            let columns = regression.columns_at(stribeck_velocity_mm_s);
            let voltage = regression.voltage_at(dead_time_s);
            solver.solve(&columns, &voltage).map(|coefficients| Self {
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
        // Where a search stands when its patience is out is judged as every other result is: by motion that is withheld.
        let found = fit_nearest(&searched, Loss::Squares, |values| {
            solved(values).map_or_else(
                || vec![f64::NAN; rows.len()],
                |solution| solution.residual(regression, rows).as_slice().to_vec(),
            )
        })?;
        solved(&found.values).ok_or_else(dependent)
    }

    pub(super) fn residual(&self, regression: &Regression<'_>, rows: &[usize]) -> DVector<f64> {
        let columns = regression.columns_at(self.stribeck_velocity_mm_s);
        let voltage = regression.voltage_at(self.dead_time_s);
        (voltage - &*columns * &self.coefficients).select_rows(rows)
    }

    /// Norm of the residual over that of the voltage, on some rows.
    pub(super) fn error_on(&self, regression: &Regression<'_>, rows: &[usize]) -> f64 {
        let voltage = regression.voltage_at(self.dead_time_s).select_rows(rows);
        self.residual(regression, rows).norm() / voltage.norm()
    }

    /// The model, in its own terms; `estimates` are its parameters with their standard errors.
    pub(super) fn model(
        &self,
        regression: &Regression<'_>,
        structure: Structure,
        settings: &MotionFitSettings,
        residual: &DVector<f64>,
        estimates: Vec<Estimate>,
    ) -> Result<MotionModel, MotionFitError> {
        let sum = |counts: &dyn Fn(Term) -> bool| -> f64 {
            let terms = regression.terms.iter().zip(self.coefficients.iter());
            terms
                .filter(|(term, _)| counts(**term))
                .map(|(_, value)| value)
                .sum()
        };
        let inertia = sum(&|term| term == Term::Inertia);
        let coulomb = sum(&|term| matches!(term, Term::Coulomb | Term::Element(_)));
        let drop = sum(&|term| term == Term::Drop);
        let viscous =
            |way: Way| sum(&|term| term == Term::Viscous(way) || term == Term::Viscous(Way::Both));
        let way = |way: Way| sliding(coulomb, drop, self.stribeck_velocity_mm_s, viscous(way));
        let change = |term: &dyn Fn(Part) -> Term| Change {
            level_v: sum(&|other| other == term(Part::Level)),
            offset_v: sum(&|other| other == term(Part::Offset)),
        };
        // An axis may have no friction, and none has no mass.
        for (name, value, unit, wrong) in [
            ("M'", inertia, "V s²/mm", inertia <= 0.0),
            ("Fs", coulomb + drop, "V", coulomb + drop < 0.0),
        ] {
            if wrong {
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
            Term::Element(knot) => Some((settings.knots_mm[*knot], *level_v)),
            _ => None,
        });
        let voltage = regression.voltage_at(self.dead_time_s);
        let rms = |norm: f64, count: usize| norm / (count as f64).sqrt();
        let accelerations = regression.columns_at(self.stribeck_velocity_mm_s);
        let accelerations = accelerations.column(0);
        let inertia_v = inertia * rms(accelerations.norm(), accelerations.len());
        Ok(MotionModel {
            structure,
            inertia_v_s2_per_mm: inertia,
            friction: PerDirection {
                positive: way(Way::Positive),
                negative: way(Way::Negative),
            },
            offset_v: sum(&|term| term == Term::Offset),
            drift: change(&Term::Drift),
            along_travel: change(&Term::AlongTravel),
            span: regression.span,
            dead_time_s: self.dead_time_s,
            hold_s: regression.hold_s(),
            elements: elements.collect(),
            estimates,
            relative_error: residual.norm() / voltage.norm(),
            residual_over_inertia: rms(residual.norm(), residual.len()) / inertia_v,
        })
    }
}
