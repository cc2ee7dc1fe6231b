//! The model fitted to the map.

use quadrant_law::friction::PerDirection;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};

use super::map::{FrictionMap, FrictionRun, LEAST_RUNS};
use crate::identify::fit::{Fit, FitError, Loss, Parameter, fit, fit_nearest};

/// Treatment of delta, the exponent of the Stribeck curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exponent {
    /// It has this value.
    Fixed(f64),
    Free,
}

/// The model of one direction.
#[derive(Clone, Debug)]
pub struct DirectionFit {
    /// The model: levels as seen at the amplifier's input, viscous friction with the linear damping in it.
    pub model: StaticFriction,
    /// Fc, Fs - Fc (below zero where the level rises with the speed), Vs, sigma and, if it was free, delta, with standard errors and correlations.
    pub fit: Fit,
    /// Standard deviation of Fs, V.
    pub breakaway_error_v: f64,
    /// Slowest and fastest speed of the runs that counted, mm/s.
    pub speeds_mm_s: (f64, f64),
}

/// The models of both directions.
#[derive(Clone, Debug)]
pub struct FrictionFit {
    pub directions: PerDirection<DirectionFit>,
    /// Half the difference of the directions' Coulomb levels, V: the amplifier's offset if the friction is the same in both,
    /// positive when the axis is pushed to larger positions.
    pub offset_v: f64,
    /// Runs that stuck and slipped and do not count.
    pub stick_slip_runs: usize,
}

impl FrictionFit {
    pub fn models(&self) -> PerDirection<StaticFriction> {
        self.directions.map(|direction| direction.model)
    }

    /// The mean of both directions' Coulomb and breakaway levels, V: free of the amplifier's offset.
    pub fn mean_levels_v(&self) -> (f64, f64) {
        let [positive, negative] = [&self.directions.positive, &self.directions.negative]
            .map(|direction| direction.model.curve);
        (
            0.5 * (positive.coulomb_v + negative.coulomb_v),
            0.5 * (positive.breakaway_v + negative.breakaway_v),
        )
    }
}

/// Reasons for which a map supports no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FrictionFitError {
    #[error(
        "{runs} runs in the {direction} direction moved evenly; the model takes {LEAST_RUNS}: measure more velocities, or \
         faster ones if the axis sticks and slips"
    )]
    TooFewRuns {
        direction: &'static str,
        runs: usize,
    },
    /// The friction has the wrong sign.
    #[error(
        "the voltage of the {direction} direction, {voltage_v:.4} V at {velocity_mm_s:.3} mm/s, does not oppose the motion: are the \
         signs of voltage and position alike, and is the axis free of load?"
    )]
    Sign {
        direction: &'static str,
        voltage_v: f64,
        velocity_mm_s: f64,
    },
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Largest residuals of a level that rises with the speed, over those of a constant one, with which it is chosen: a rise is easily
/// mistaken for viscous friction.
const MAX_RESIDUAL_RATIO: f64 = 0.7;
/// Level at rest, over that at high speed, below which a rise is no friction's.
const LEAST_LEVEL: f64 = 0.2;
/// Largest level at rest over the largest voltage of any run that counts as measured: beyond, only the curve says so.
const MAX_EXTRAPOLATION: f64 = 1.25;
/// Viscous friction below which there is none, V s/mm.
const LEAST_VISCOUS: f64 = 1e-9;
/// An error of each mean that does not scatter within its run, over the voltage.
const SYSTEMATIC_ERROR: f64 = 2e-4;

/// Viscous friction by another measurement, such as a linear model's `B / A`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownViscous {
    /// Its value, V s/mm.
    pub value: f64,
    /// Its standard deviation, V s/mm.
    pub deviation: f64,
}

/// Fits both directions, also to the viscous friction that is known otherwise: runs that are slow, few or uneven do not tell it from the end
/// of the Stribeck curve.
///
/// # Errors
/// A map that cannot support the model, with the reason and what would.
pub fn fit_map(
    map: &FrictionMap,
    exponent: Exponent,
    viscous: Option<KnownViscous>,
) -> Result<FrictionFit, FrictionFitError> {
    let direction = |sign: f64, name: &'static str| {
        fit_direction(&map.direction(sign), exponent, viscous, name)
    };
    let positive = direction(1.0, "positive")?;
    let negative = direction(-1.0, "negative")?;
    let levels = [&positive, &negative].map(|direction| direction.model.curve.coulomb_v);
    Ok(FrictionFit {
        offset_v: 0.5 * (levels[1] - levels[0]),
        directions: PerDirection { positive, negative },
        stick_slip_runs: map.runs.iter().filter(|run| run.stick_slip).count(),
    })
}

/// The model of the values in the order Fc, Fs - Fc, Vs, sigma, delta.
fn model(values: &[f64], fixed: f64) -> StaticFriction {
    StaticFriction {
        curve: StribeckCurve {
            coulomb_v: values[0],
            breakaway_v: values[0] + values[1],
            stribeck_velocity_mm_s: values[2],
            exponent: values.get(4).copied().unwrap_or(fixed),
        },
        viscous_v_s_per_mm: values[3],
    }
}

fn fit_direction(
    runs: &[FrictionRun],
    exponent: Exponent,
    viscous: Option<KnownViscous>,
    direction: &'static str,
) -> Result<DirectionFit, FrictionFitError> {
    let (Some(slowest), Some(fastest), true) =
        (runs.first(), runs.last(), runs.len() >= LEAST_RUNS)
    else {
        return Err(FrictionFitError::TooFewRuns {
            direction,
            runs: runs.len(),
        });
    };
    if let Some(odd) = runs.iter().find(|run| run.voltage_v <= 0.0) {
        return Err(FrictionFitError::Sign {
            direction,
            voltage_v: odd.voltage_v,
            velocity_mm_s: odd.velocity_mm_s,
        });
    }
    let least = runs
        .iter()
        .map(|run| run.voltage_v)
        .fold(f64::INFINITY, f64::min);
    let most = runs.iter().map(|run| run.voltage_v).fold(0.0, f64::max);
    let (low, high) = (slowest.velocity_mm_s, fastest.velocity_mm_s);
    let slope = ((fastest.voltage_v - least) / high)
        .max(viscous.map_or(LEAST_VISCOUS, |known| known.value));
    let mut parameters = vec![
        Parameter {
            name: "Fc",
            start: least,
            bounds: (0.1 * least, 2.0 * most),
        },
        Parameter {
            name: "Fs - Fc",
            start: (slowest.voltage_v - least).max(0.02 * least),
            bounds: (0.0, 5.0 * most),
        },
        Parameter {
            name: "Vs",
            start: (low * high).sqrt(),
            bounds: (0.2 * low, high),
        },
        Parameter {
            name: "sigma",
            start: slope,
            bounds: (0.0, 20.0 * slope),
        },
    ];
    let fixed = match exponent {
        Exponent::Fixed(value) => value,
        Exponent::Free => {
            parameters.push(Parameter {
                name: "delta",
                start: 1.2,
                bounds: (0.4, 3.0),
            });
            1.0
        }
    };
    let misfits = |values: &[f64]| -> Vec<f64> {
        let model = model(values, fixed);
        runs.iter()
            .map(|run| {
                let deviation = run.deviation_v.hypot(SYSTEMATIC_ERROR * run.voltage_v);
                (model.friction_v(run.velocity_mm_s) - run.voltage_v) / deviation
            })
            .collect()
    };
    // Where Fs hardly differs from Fc, Vs means nothing, and a search for it has no end: where it stands will do.
    let search_by =
        |parameters: &[Parameter], residuals: &(dyn Fn(&[f64]) -> Vec<f64> + Sync)| match fit(
            parameters,
            Loss::Huber,
            residuals,
        ) {
            Err(FitError::NotConverged) => fit_nearest(parameters, Loss::Huber, residuals),
            found => found,
        };
    let scatter = match viscous {
        // By what the runs do not fit, they are less exact than they scatter.
        Some(_) => search_by(&parameters, &misfits)?.residual_rms.max(1.0),
        None => 1.0,
    };
    let residuals = |values: &[f64]| -> Vec<f64> {
        let runs = misfits(values).into_iter().map(|misfit| misfit / scatter);
        let known = viscous.map(|known| (values[3] - known.value) / known.deviation);
        runs.chain(known).collect()
    };
    let search = |parameters: &[Parameter]| search_by(parameters, &residuals);
    let mut fit = search(&parameters)?;
    if fit.values[0] + fit.values[1] > MAX_EXTRAPOLATION * most {
        parameters[1].bounds.1 = (MAX_EXTRAPOLATION - 1.0) * most;
        parameters[1].start = parameters[1].start.min(0.5 * parameters[1].bounds.1);
        parameters[2].bounds.0 = low;
        fit = search(&parameters)?;
    }
    let mut rising = parameters;
    rising[1] = Parameter {
        start: slowest.voltage_v - fastest.voltage_v,
        bounds: (-most, 0.0),
        ..rising[1]
    };
    rising[0].start = fastest.voltage_v;
    if rising[1].start < 0.0
        && let Ok(rising) = search(&rising)
        && rising.residual_rms < MAX_RESIDUAL_RATIO * fit.residual_rms
        && rising.values[0] + rising.values[1] > LEAST_LEVEL * rising.values[0]
    {
        fit = rising;
    }
    let fit = fit.no_better_than_stated();
    let variance = fit.covariance(0, 0) + 2.0 * fit.covariance(0, 1) + fit.covariance(1, 1);
    Ok(DirectionFit {
        model: model(&fit.values, fixed),
        // Not a number where one of the two is unknown.
        breakaway_error_v: if variance.is_nan() {
            f64::INFINITY
        } else {
            variance.max(0.0).sqrt()
        },
        fit,
        speeds_mm_s: (low, high),
    })
}
