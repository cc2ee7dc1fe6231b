//! Elements from the virgin curve, and their refinement on the whole hysteresis.

use quadrant_law::friction::PerDirection;
use quadrant_law::friction::gms::{GmsParameters, MAX_ELEMENTS};
use quadrant_law::friction::stribeck::StaticFriction;

use super::branches::{Smooth, VirginCurve, range};
use super::error::VirginCurveError;
use super::plateau::{check_plateau, plateau};
use super::predict::{Prediction, Trajectory};
use super::shape::{Shape, parameters};
use crate::identify::fit::{Fit, Loss, Parameter, fit_nearest, fit_with_step};
use crate::record::Recording;

/// An identified GMS model.
#[derive(Clone, Debug)]
pub struct GmsFit {
    pub curve: VirginCurve,
    /// The elements as the knots on the virgin curve give them, and the attraction rate as it was assumed.
    pub from_curve: GmsParameters,
    /// The model, refined on the hysteresis.
    pub gms: GmsParameters,
    /// Knots x_i of the model, mm.
    pub knots_mm: Vec<f64>,
    /// Refined parameters: knots unless they were given, shares, C, with standard errors and correlations.
    pub fit: Fit,
    /// True if the record determines C; if not, it is as assumed.
    pub attraction_determined: bool,
    /// Measured and predicted hysteresis.
    pub prediction: Prediction,
}

/// C as long as nothing determines it, V/s.
pub const ASSUMED_ATTRACTION_V_S: f64 = 5.0;
/// Share of the plateau up to which the curve is fitted: beyond it an axis may stick and slip.
const FITTED_SHARE: f64 = 0.97;
/// Every so many samples of the hysteresis count in the refinement: neighbours are correlated by the smoothing.
const THINNING: usize = 20;
/// Step of the difference quotients: pieces of straight lines have corners.
const ROUGH_STEP: f64 = 1e-3;
/// Relative standard error of C beyond which it is not determined.
const MOST_UNCERTAIN: f64 = 0.3;

/// Knots of the elements.
#[derive(Clone, Debug, PartialEq)]
pub enum Knots {
    /// So many, where they fit the curve best.
    Automatic(usize),
    /// At these displacements, mm.
    At(Vec<f64>),
}

impl Knots {
    /// The knots that are given.
    fn held(&self) -> Option<&[f64]> {
        match self {
            Self::Automatic(_) => None,
            Self::At(places) => Some(places),
        }
    }
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
    let refined = refine(&smooth, &reversals, &sliding, level_v, &shape, knots.held())?;
    Ok(GmsFit {
        curve,
        from_curve,
        ..refined
    })
}

/// Knots and shares that fit the curve up to where the axis slides.
fn fit_curve(
    curve: &VirginCurve,
    level_v: f64,
    knots: &Knots,
    count: usize,
) -> Result<Shape, VirginCurveError> {
    let top_v = curve.top_v();
    let rising = curve
        .points
        .partition_point(|point| point.force_v < FITTED_SHARE * top_v.min(level_v));
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
    let held = knots.held();
    let variables = start.parameters(held.is_some());
    if variables.is_empty() {
        return Ok(start);
    }
    // A start for the refinement: the nearest it gets will do.
    let found = fit_nearest(&variables, Loss::Squares, |values| {
        let shape = Shape::from_variables(values, count, held);
        let points = fitted.iter();
        points
            .map(|point| shape.at(point.displacement_mm) * level_v - point.force_v)
            .collect()
    })?;
    Ok(Shape::from_variables(&found.values, count, held))
}

/// Refines knots, shares and C on the hysteresis.
fn refine(
    smooth: &Smooth,
    reversals: &[usize],
    sliding: &PerDirection<StaticFriction>,
    level_v: f64,
    start: &Shape,
    held: Option<&[f64]>,
) -> Result<GmsFit, VirginCurveError> {
    let count = start.knots_mm.len();
    let scored = reversals[1]..*reversals.last().unwrap_or(&smooth.position_mm.len());
    let mut variables = start.parameters(held.is_some());
    let attraction = variables.len();
    variables.push(Parameter {
        name: "ln C",
        start: ASSUMED_ATTRACTION_V_S.ln(),
        bounds: (
            ASSUMED_ATTRACTION_V_S.ln() - 3.5,
            ASSUMED_ATTRACTION_V_S.ln() + 3.5,
        ),
    });
    let model = |values: &[f64]| {
        let shape = Shape::from_variables(values, count, held);
        parameters(&shape, level_v, values[attraction].exp())
    };
    let trajectory = Trajectory::new(smooth, sliding);
    let found = fit_with_step(&variables, Loss::Squares, ROUGH_STEP, |values| {
        let predicted = trajectory.predict(&model(values), scored.end);
        scored
            .clone()
            .step_by(THINNING)
            .map(|index| predicted[index] - smooth.voltage_v[index])
            .collect()
    })?;
    let attraction_determined =
        found.standard_errors[attraction] < MOST_UNCERTAIN && !found.at_bound[attraction];
    let mut gms = model(&found.values);
    if !attraction_determined {
        gms.attraction_v_s = ASSUMED_ATTRACTION_V_S;
    }
    let predicted_v = trajectory.predict(&gms, smooth.position_mm.len());
    let squares: f64 = scored
        .clone()
        .map(|index| (predicted_v[index] - smooth.voltage_v[index]).powi(2))
        .sum();
    Ok(GmsFit {
        curve: VirginCurve::default(),
        from_curve: gms.clone(),
        knots_mm: Shape::from_variables(&found.values, count, held).knots_mm,
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
