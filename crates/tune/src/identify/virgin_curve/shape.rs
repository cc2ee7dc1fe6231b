//! The shape of a virgin curve over its plateau: knots and shares of the elements.

use heapless::Vec as ShortVec;
use quadrant_law::friction::gms::{GmsElement, GmsParameters, MAX_ELEMENTS};

use crate::identify::fit::Parameter;

/// Least ratio of a knot to the one before.
const SMALLEST_RATIO: f64 = 1.2;
/// Largest ratio of a knot to the one before.
const LARGEST_RATIO: f64 = 3.5;
/// Least share of an element in what those before have left.
const LEAST_SHARE: f64 = 0.05;

/// Knots and shares, in variables that any values are allowed for: each knot over the one before, each share of what
/// the ones before have left.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) knots_mm: Vec<f64>,
    pub(super) weights: Vec<f64>,
}

impl Shape {
    /// The shape of `count` elements from its variables: knots, unless they are `held`, then shares.
    pub(super) fn from_variables(values: &[f64], count: usize, held: Option<&[f64]>) -> Self {
        let (knots_mm, shares) = match held {
            Some(knots) => (knots.to_vec(), values),
            None => {
                let (steps, shares) = values.split_at(count);
                let rise = steps.iter().scan(0.0, |log_knot, step| {
                    *log_knot += step;
                    Some(log_knot.exp())
                });
                (rise.collect(), shares)
            }
        };
        let mut left = 1.0;
        let mut weights: Vec<f64> = shares[..count - 1]
            .iter()
            .map(|share| {
                let weight = left * share;
                left -= weight;
                weight
            })
            .collect();
        weights.push(left);
        Self { knots_mm, weights }
    }

    /// The variables, as parameters to be fitted; none for knots that are held.
    pub(super) fn parameters(&self, held: bool) -> Vec<Parameter> {
        let mut parameters = Vec::new();
        if !held {
            let first = self.knots_mm[0].ln();
            parameters.push(Parameter {
                name: "ln x",
                start: first,
                bounds: (first - 2.0, first + 2.0),
            });
            let (low, high) = (SMALLEST_RATIO.ln(), LARGEST_RATIO.ln());
            parameters.extend(self.knots_mm.windows(2).map(|pair| Parameter {
                name: "ln x ratio",
                start: (pair[1] / pair[0]).ln().clamp(low + 0.05, high - 0.05),
                bounds: (low, high),
            }));
        }
        let mut left = 1.0;
        for weight in &self.weights[..self.weights.len() - 1] {
            parameters.push(Parameter {
                name: "share",
                start: (weight / left).clamp(LEAST_SHARE + 0.01, 0.99 - LEAST_SHARE),
                bounds: (LEAST_SHARE, 1.0 - LEAST_SHARE),
            });
            left -= weight;
        }
        parameters
    }

    /// The virgin curve over its plateau.
    pub(super) fn at(&self, displacement_mm: f64) -> f64 {
        self.knots_mm
            .iter()
            .zip(&self.weights)
            .map(|(knot, weight)| weight * (displacement_mm / knot).min(1.0))
            .sum()
    }
}

/// The GMS model of a shape on a level.
pub(super) fn parameters(shape: &Shape, level_v: f64, attraction_v_s: f64) -> GmsParameters {
    let elements: ShortVec<GmsElement, MAX_ELEMENTS> = shape
        .knots_mm
        .iter()
        .zip(&shape.weights)
        .map(|(knot, &weight)| GmsElement {
            stiffness_v_per_mm: weight * level_v / knot,
            weight,
        })
        .collect();
    GmsParameters {
        elements,
        attraction_v_s,
    }
}
