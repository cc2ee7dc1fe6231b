//! Elements from the virgin curve, and their refinement on the whole hysteresis.

use heapless::Vec as ShortVec;
use quadrant::friction::PerDirection;
use quadrant::friction::gms::{GmsElement, GmsParameters, MAX_ELEMENTS};
use quadrant::friction::stribeck::{StaticFriction, StribeckCurve};

use super::branches::{Smooth, VirginCurve, VirginPoint, range};
use super::predict::{Prediction, predict};
use crate::identify::fit::{Fit, FitError, Loss, Parameter, fit, fit_with_step};
use crate::rig::Recording;

/// An identified GMS model.
#[derive(Clone, Debug)]
pub struct GmsFit {
    /// The virgin curve.
    pub curve: VirginCurve,
    /// The elements as the knots on the virgin curve give them, and the attraction rate as it was assumed.
    pub from_curve: GmsParameters,
    /// The model, refined on the hysteresis.
    pub gms: GmsParameters,
    /// Knots x_i of the model, mm.
    pub knots_mm: Vec<f64>,
    /// Refined parameters: knots, shares, C, with standard errors and correlations.
    pub fit: Fit,
    /// Whether the record determines C; if not, it is as assumed.
    pub attraction_determined: bool,
    /// Measured and predicted hysteresis.
    pub prediction: Prediction,
}

/// Why a recording gives no GMS model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VirginCurveError {
    /// The axis did not turn round often enough.
    #[error(
        "the axis turned round {reversals} times; the hysteresis takes at least 4: record more cycles, or a larger amplitude if the \
         axis hardly moved ({travel_um:.1} um)"
    )]
    TooFewReversals {
        /// How often it did.
        reversals: usize,
        /// How far it moved.
        travel_um: f64,
    },
    /// The friction never reached its plateau.
    #[error(
        "the axis moved by {travel_um:.1} um and its friction was still rising at {reached_v:.4} V: it never slid, and the curve's end \
         is unknown. A sine of about {needed_um:.0} um would reach the plateau"
    )]
    NoPlateau {
        /// How far it moved.
        travel_um: f64,
        /// The friction reached.
        reached_v: f64,
        /// The amplitude that would do.
        needed_um: f64,
    },
    /// A number of elements, or knots, that cannot be.
    #[error(
        "{count} elements; a GMS model has 1 to {MAX_ELEMENTS}, with knots that rise from above zero"
    )]
    Elements {
        /// How many were asked for.
        count: usize,
    },
    /// The search failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// C as long as nothing determines it, V/s.
pub const ASSUMED_ATTRACTION_V_S: f64 = 5.0;
/// Slope at the end of the curve over its slope at the beginning below which it is flat.
const FLAT: f64 = 0.04;
/// Share of the plateau up to which the curve is fitted: beyond it an axis may stick and slip.
const FITTED: f64 = 0.97;
/// Every so many samples of the hysteresis count in the refinement: neighbours are correlated by the smoothing.
const THINNING: usize = 20;
/// Relative standard error of C beyond which it is not determined.
const MOST_UNCERTAIN: f64 = 0.3;

/// Bounds of each knot over the one before, and the least share of an element in what those before have left.
const SMALLEST_RATIO: f64 = 1.2;
const LARGEST_RATIO: f64 = 3.5;
const LEAST_SHARE: f64 = 0.05;

/// Which knots the elements have.
#[derive(Clone, Debug, PartialEq)]
pub enum Knots {
    /// So many, where they fit the curve best.
    Automatic(usize),
    /// At these displacements, mm.
    At(Vec<f64>),
}

/// Identifies the GMS model. `sliding` is the static friction, as identified by runs at constant velocity; without it the
/// plateau of this record stands for it, the same at every velocity.
///
/// # Errors
/// A recording without a plateau or without enough reversals, or an impossible choice of knots.
pub fn identify(
    recording: &Recording,
    sliding: Option<&PerDirection<StaticFriction>>,
    knots: &Knots,
) -> Result<GmsFit, VirginCurveError> {
    let count = match knots {
        Knots::Automatic(count) => *count,
        Knots::At(places) => {
            let rise = places.windows(2).all(|pair| pair[0] < pair[1]);
            if rise && places.first().is_some_and(|first| *first > 0.0) {
                places.len()
            } else {
                0
            }
        }
    };
    if !(1..=MAX_ELEMENTS).contains(&count) {
        return Err(VirginCurveError::Elements { count });
    }
    let smooth = Smooth::of(recording);
    let reversals = smooth.reversals();
    let (low, high) = range(&smooth.position_mm);
    let travel_um = 1e3 * (high - low);
    if reversals.len() < 4 {
        return Err(VirginCurveError::TooFewReversals {
            reversals: reversals.len(),
            travel_um,
        });
    }
    let curve = smooth.virgin_curve();
    check_plateau(&curve, recording, travel_um)?;
    let sliding = sliding
        .copied()
        .unwrap_or_else(|| plateau(&smooth, &reversals));
    let level_v = 0.5 * (sliding.positive.curve.breakaway_v + sliding.negative.curve.breakaway_v);
    let shape = fit_curve(&curve, level_v, knots, count)?;
    let from_curve = parameters(&shape, level_v, ASSUMED_ATTRACTION_V_S);
    let refined = refine(
        &smooth,
        &reversals,
        &sliding,
        level_v,
        &shape,
        matches!(knots, Knots::At(_)),
    )?;
    Ok(GmsFit {
        curve,
        from_curve,
        ..refined
    })
}

/// Whether the curve has become flat; an exponential through it says how far it would have to go.
fn check_plateau(
    curve: &VirginCurve,
    recording: &Recording,
    travel_um: f64,
) -> Result<(), VirginCurveError> {
    let Some(end) = curve.points.last() else {
        return Ok(());
    };
    let slope = |from: &VirginPoint, to: &VirginPoint| {
        (to.force_v - from.force_v) / (to.displacement_mm - from.displacement_mm)
    };
    let by_share = |share: f64| {
        let place = curve
            .points
            .partition_point(|point| point.force_v < share * end.force_v);
        curve.points[place.min(curve.points.len() - 1)]
    };
    let origin = VirginPoint {
        displacement_mm: 0.0,
        force_v: 0.0,
    };
    let initial = slope(&origin, &by_share(0.4));
    let three_quarters = curve
        .points
        .iter()
        .find(|point| point.displacement_mm >= 0.7 * end.displacement_mm)
        .unwrap_or(end);
    let last = slope(three_quarters, end);
    if last <= FLAT * initial {
        return Ok(());
    }
    let rate = Parameter {
        name: "range",
        start: end.displacement_mm,
        bounds: (0.05 * end.displacement_mm, 50.0 * end.displacement_mm),
    };
    let level = Parameter {
        name: "level",
        start: 1.5 * end.force_v,
        bounds: (0.5 * end.force_v, 100.0 * end.force_v),
    };
    let found = fit(&[rate, level], Loss::Squares, |values| {
        let points = curve.points.iter();
        points
            .map(|point| {
                values[1] * (1.0 - (-point.displacement_mm / values[0]).exp()) - point.force_v
            })
            .collect()
    })?;
    // The reference must outrun the controller's error at breakaway, and the axis then five times the range both ways.
    let (low, high) = range(&recording.reference_mm);
    let amplitude_mm = 0.5 * (high - low);
    let needed_mm =
        2.0 * amplitude_mm * (found.values[1] / end.force_v).max(1.0) + 10.0 * found.values[0];
    Err(VirginCurveError::NoPlateau {
        travel_um,
        reached_v: end.force_v,
        needed_um: 1e3 * needed_mm,
    })
}

/// The level of this record's plateau in both directions, as a friction that does not depend on velocity.
fn plateau(smooth: &Smooth, reversals: &[usize]) -> PerDirection<StaticFriction> {
    let mut sums = [(0.0, 0.0); 2];
    for turn in reversals.windows(2).skip(1) {
        let positive = smooth.position_mm[turn[1]] > smooth.position_mm[turn[0]];
        let from = turn[0] + (turn[1] - turn[0]) * 3 / 4;
        let sum = &mut sums[usize::from(!positive)];
        for voltage in &smooth.voltage_v[from..turn[1]] {
            sum.0 += voltage.abs();
            sum.1 += 1.0;
        }
    }
    let model = |(sum, count): (f64, f64)| StaticFriction {
        curve: StribeckCurve {
            coulomb_v: sum / count,
            breakaway_v: sum / count,
            stribeck_velocity_mm_s: 1.0,
            exponent: 1.0,
        },
        viscous_v_s_per_mm: 0.0,
    };
    PerDirection {
        positive: model(sums[0]),
        negative: model(sums[1]),
    }
}

/// Knots and shares, in variables that any values are allowed for: each knot over the one before, each share of what
/// the ones before have left.
#[derive(Clone, Debug)]
struct Shape {
    knots_mm: Vec<f64>,
    weights: Vec<f64>,
}

impl Shape {
    fn from_variables(values: &[f64], count: usize) -> Self {
        let mut knots_mm = Vec::with_capacity(count);
        let mut log_knot = values[0];
        knots_mm.push(log_knot.exp());
        for step in &values[1..count] {
            log_knot += step;
            knots_mm.push(log_knot.exp());
        }
        let mut left = 1.0;
        let mut weights: Vec<f64> = values[count..2 * count - 1]
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

    /// The variables, as parameters to be fitted, with the knots held if they are given.
    fn parameters(&self, held: bool) -> Vec<Parameter> {
        let room = if held { 1e-6 } else { 1.0 };
        let first = self.knots_mm[0].ln();
        let mut parameters = vec![Parameter {
            name: "ln x",
            start: first,
            bounds: (first - 2.0 * room, first + 2.0 * room),
        }];
        parameters.extend(self.knots_mm.windows(2).map(|pair| {
            let ratio = (pair[1] / pair[0]).ln();
            let (low, high) = (SMALLEST_RATIO.ln(), LARGEST_RATIO.ln());
            Parameter {
                name: "ln x ratio",
                start: if held {
                    ratio
                } else {
                    ratio.clamp(low + 0.05, high - 0.05)
                },
                bounds: if held {
                    (ratio - room, ratio + room)
                } else {
                    (low, high)
                },
            }
        }));
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
    fn at(&self, displacement_mm: f64) -> f64 {
        self.knots_mm
            .iter()
            .zip(&self.weights)
            .map(|(knot, weight)| weight * (displacement_mm / knot).min(1.0))
            .sum()
    }
}

/// The GMS model of a shape on a level.
fn parameters(shape: &Shape, level_v: f64, attraction_v_s: f64) -> GmsParameters {
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

/// Knots and shares that fit the curve up to where the axis slides.
fn fit_curve(
    curve: &VirginCurve,
    level_v: f64,
    knots: &Knots,
    count: usize,
) -> Result<Shape, VirginCurveError> {
    let top_v = curve
        .points
        .iter()
        .map(|point| point.force_v)
        .fold(0.0, f64::max);
    let rising = curve
        .points
        .partition_point(|point| point.force_v < FITTED * top_v.min(level_v));
    let fitted = &curve.points[..rising.max(2 * count).min(curve.points.len())];
    let reach_mm = fitted.last().map_or(1e-3, |point| point.displacement_mm);
    let start = Shape {
        knots_mm: match knots {
            Knots::Automatic(_) => (1..=count)
                .map(|index| 1.2 * reach_mm * (index as f64 / count as f64).powi(2))
                .collect(),
            Knots::At(places) => places.clone(),
        },
        weights: vec![1.0 / count as f64; count],
    };
    let held = matches!(knots, Knots::At(_));
    let found = fit(&start.parameters(held), Loss::Squares, |values| {
        let shape = Shape::from_variables(values, count);
        let points = fitted.iter();
        points
            .map(|point| shape.at(point.displacement_mm) * level_v - point.force_v)
            .collect()
    })?;
    Ok(Shape::from_variables(&found.values, count))
}

/// Refines knots, shares and C on the hysteresis.
fn refine(
    smooth: &Smooth,
    reversals: &[usize],
    sliding: &PerDirection<StaticFriction>,
    level_v: f64,
    start: &Shape,
    held: bool,
) -> Result<GmsFit, VirginCurveError> {
    let count = start.knots_mm.len();
    let scored = reversals[1]..*reversals.last().unwrap_or(&smooth.position_mm.len());
    let mut variables = start.parameters(held);
    variables.push(Parameter {
        name: "ln C",
        start: ASSUMED_ATTRACTION_V_S.ln(),
        bounds: (
            ASSUMED_ATTRACTION_V_S.ln() - 3.5,
            ASSUMED_ATTRACTION_V_S.ln() + 3.5,
        ),
    });
    let model = |values: &[f64]| {
        let shape = Shape::from_variables(values, count);
        parameters(&shape, level_v, values[2 * count - 1].exp())
    };
    let found = fit_with_step(&variables, Loss::Squares, 1e-3, |values| {
        let predicted = predict(smooth, sliding, &model(values));
        scored
            .clone()
            .step_by(THINNING)
            .map(|index| predicted[index] - smooth.voltage_v[index])
            .collect()
    })?;
    let attraction_error = found.standard_errors[2 * count - 1];
    let attraction_determined = attraction_error < MOST_UNCERTAIN && !found.at_bound[2 * count - 1];
    let mut gms = model(&found.values);
    if !attraction_determined {
        gms.attraction_v_s = ASSUMED_ATTRACTION_V_S;
    }
    let predicted_v = predict(smooth, sliding, &gms);
    let squares: f64 = scored
        .clone()
        .map(|index| (predicted_v[index] - smooth.voltage_v[index]).powi(2))
        .sum();
    Ok(GmsFit {
        curve: VirginCurve::default(),
        from_curve: gms.clone(),
        knots_mm: Shape::from_variables(&found.values, count).knots_mm,
        gms,
        fit: found,
        attraction_determined,
        prediction: Prediction {
            relative_error: (squares / scored.len() as f64).sqrt() / level_v,
            position_mm: smooth.position_mm.clone(),
            measured_v: smooth.voltage_v.clone(),
            predicted_v,
        },
    })
}
