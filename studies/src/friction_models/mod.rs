//! The friction models side by side, on the same motions and from the same virgin curve: what each can do.
//!
//! - virgin curve and hysteresis, slowly, over the pre-sliding range and a third of it;
//! - memory: a small loop within a large one, which closes if the model remembers more than one number;
//! - drift of a free mass under a load below breakaway that vibrates ([`mod@drift`]);
//! - lag of friction behind a changing sliding velocity;
//! - how abruptly the force and its slope change;
//! - what is left of the tracking error with each as feedforward, on axes that follow one or the other ([`tracking`]).
//!
//! Simulated, with the library's own code in `f64`: the models are moved, or act as the truth of a simulated axis.

pub mod command;
pub mod drift;
mod driven;
pub mod page;
mod parameters;
pub mod tracking;

use indicatif::ProgressBar;
use rayon::prelude::*;

use drift::{Drift, drift};
use driven::Driven;

pub use driven::Curve;
pub use parameters::{Model, Parameters, ParametersError};

/// A small loop within a large one.
#[derive(Clone, Debug, PartialEq)]
pub struct Nested {
    pub path: Curve,
    /// Difference between the forces before and after the small loop, at the same place, over the breakaway level.
    pub closing_error: f64,
}

/// Friction in a sliding motion whose velocity swings.
#[derive(Clone, Debug, PartialEq)]
pub struct Lag {
    /// Frequency of the swing, Hz.
    pub frequency_hz: f64,
    /// Friction without its viscous part against velocity, over one period.
    pub path: Curve,
    /// Friction while the velocity rises less friction while it falls, at the mean velocity, V.
    pub width_v: f64,
}

/// Behaviour of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct Behaviour {
    pub model: Model,
    /// From rest, springs slack.
    pub virgin: Curve,
    /// Slope of the virgin curve, V/mm.
    pub slope: Curve,
    /// Settled loops over the pre-sliding range and a third of it.
    pub loops: [Curve; 2],
    /// RMS difference of the loops to the GMS's, over the breakaway level.
    pub loop_error: f64,
    /// Memory; none is asked of the static model.
    pub nested: Option<Nested>,
    /// Drift under vibration; the static model cannot be simulated.
    pub drift: Option<Drift>,
    /// Lag in sliding at each of [`LAG_FREQUENCIES_HZ`].
    pub lags: Vec<Lag>,
    /// Change of the force over the first nanometre after a reversal, V.
    pub reversal_step_v: f64,
    /// Largest change of the virgin curve's slope within three nanometres, V/mm.
    pub slope_step_v_per_mm: f64,
}

/// Control period at which the models are evaluated, s.
const PERIOD_S: f64 = 1e-4;
/// A nanometre per control period: slow enough for the breakaway level (0.01 mm/s).
const NANOMETRE: f64 = 1e-6;
/// Frequencies of the swinging velocity, Hz.
pub const LAG_FREQUENCIES_HZ: [f64; 2] = [1.0, 10.0];
/// Points that are kept of a path.
const KEPT: usize = 2000;

/// Compares all models of an axis; `bar` counts them.
pub fn compare(parameters: &Parameters, bar: &ProgressBar) -> Vec<Behaviour> {
    let mut found: Vec<Behaviour> = Model::ALL
        .into_par_iter()
        .map(|model| {
            let behaviour = observe(parameters, model);
            bar.inc(1);
            behaviour
        })
        .collect();
    let level_v = parameters.friction.mean_breakaway_v();
    let gms = Model::ALL.into_iter().position(|m| m == Model::Gms);
    let expected = gms.map_or_else(Default::default, |index| found[index].loops.clone());
    for behaviour in &mut found {
        let squares: Vec<f64> = behaviour
            .loops
            .iter()
            .zip(&expected)
            .flat_map(|((_, force), (_, expected))| force.iter().zip(expected))
            .map(|(force, expected)| (force - expected).powi(2))
            .collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        behaviour.loop_error = mean.sqrt() / level_v;
    }
    found
}

fn observe(parameters: &Parameters, model: Model) -> Behaviour {
    let range = parameters.range_mm();
    let truth = parameters.truth(model);
    let slack = || Driven::new(parameters, truth.as_ref(), PERIOD_S);
    let virgin = slack().travel(1.2 * range, NANOMETRE);
    let slopes: Vec<f64> = virgin
        .1
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) / NANOMETRE)
        .collect();
    // A kink in the middle of a step shows in two steps: the steps on both sides of it are compared.
    let slope_step_v_per_mm = slopes
        .windows(3)
        .map(|three| (three[2] - three[0]).abs())
        .fold(0.0, f64::max);
    let mut turning = slack();
    let before = turning.travel(range, NANOMETRE).1.last().copied();
    let after = turning.travel(-NANOMETRE, NANOMETRE).1.last().copied();
    let slope = (virgin.0[1..].to_vec(), slopes);
    Behaviour {
        model,
        virgin: thinned(&virgin),
        slope: thinned(&slope),
        loops: [1.0, 1.0 / 3.0].map(|share| thinned(&settled_loop(slack(), share * range))),
        loop_error: 0.0,
        nested: (model != Model::Static)
            .then(|| nested(slack(), range, parameters.friction.mean_breakaway_v())),
        drift: truth.as_ref().map(|truth| drift(truth, parameters)),
        lags: LAG_FREQUENCIES_HZ
            .into_iter()
            .map(|frequency_hz| lag(slack(), parameters, frequency_hz))
            .collect(),
        reversal_step_v: before
            .zip(after)
            .map_or(0.0, |(before, after)| (after - before).abs()),
        slope_step_v_per_mm,
    }
}

/// The second cycle between the amplitude and its negative.
fn settled_loop(mut model: Driven, amplitude_mm: f64) -> Curve {
    model.travel(amplitude_mm, NANOMETRE);
    model.travel(-2.0 * amplitude_mm, NANOMETRE);
    model.travel(2.0 * amplitude_mm, NANOMETRE);
    let (mut x, mut force) = model.travel(-2.0 * amplitude_mm, NANOMETRE);
    let (back_x, back_force) = model.travel(2.0 * amplitude_mm, NANOMETRE);
    x.extend(back_x);
    force.extend(back_force);
    (x, force)
}

/// Down and up the pre-sliding range, with a small loop on the way up.
fn nested(mut model: Driven, range_mm: f64, level_v: f64) -> Nested {
    let mut path = Curve::default();
    let mut go = |share: f64| {
        let (x, force) = model.travel(share * range_mm, NANOMETRE);
        path.0.extend(x);
        path.1.extend(&force);
        force.last().copied().unwrap_or_default()
    };
    go(1.0);
    go(-2.0);
    let before = go(1.2);
    go(-0.4);
    let after = go(0.4);
    go(0.8);
    Nested {
        path: thinned(&path),
        closing_error: (after - before).abs() / level_v,
    }
}

/// Share of the Stribeck velocity by which the velocity swings about it.
const SWING: f64 = 0.9;

/// Sliding at the Stribeck velocity, which swings by most of itself.
fn lag(mut model: Driven, parameters: &Parameters, frequency_hz: f64) -> Lag {
    let mean = parameters
        .friction
        .sliding
        .positive
        .curve
        .stribeck_velocity_mm_s;
    let ticks = (1.0 / (frequency_hz * PERIOD_S)).round() as usize;
    let velocity = |tick: usize| {
        let phase = std::f64::consts::TAU * tick as f64 / ticks as f64;
        mean * (1.0 + SWING * phase.sin())
    };
    // A second of sliding, or two periods, for the start to be forgotten.
    let settling = ticks * (2 * ticks).max(10_000).div_ceil(ticks);
    let mut path = Curve::default();
    for tick in 0..settling + ticks {
        let force = model.step(velocity(tick) * PERIOD_S);
        if tick >= settling {
            path.0.push(velocity(tick));
            path.1.push(force);
        }
    }
    Lag {
        frequency_hz,
        width_v: path.1[0] - path.1[ticks / 2],
        path: thinned(&path),
    }
}

/// Every n-th point, and the last.
fn thinned((x, y): &Curve) -> Curve {
    let stride = x.len().div_ceil(KEPT).max(1);
    let last = x.len().saturating_sub(1);
    let kept = || (0..x.len()).filter(move |index| index % stride == 0 || *index == last);
    (
        kept().map(|index| x[index]).collect(),
        kept().map(|index| y[index]).collect(),
    )
}
