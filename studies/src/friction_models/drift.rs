//! A free mass under a load that stays below breakaway and vibrates. A body at rest on real friction settles; a model that
//! forgets where its bristles came from lets it creep.

use std::f64::consts::TAU;

use quadrant_law::units::DacCode;
use quadrant_sim::plant::{AxisParameters, SimulatedAxis};

use crate::friction_models::Parameters;

/// Mean of the load over the lowest Coulomb level.
pub const MEAN: f64 = 0.4;
/// Amplitude of its vibration over the same level; the peak stays below every model's breakaway.
pub const AMPLITUDE: f64 = 0.4;
/// Frequency of the vibration, Hz: far below the pre-sliding resonance.
pub const FREQUENCY_HZ: f64 = 20.0;
/// Duration, s.
const DURATION_S: f64 = 20.0;
/// Time over which the load rises from zero, s, so that nothing rings.
const RISE_S: f64 = 0.5;
/// Steps of the load a second.
const RATE_HZ: f64 = 10e3;

/// Motion of the mass under the drift test.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Means over each period of the vibration: time in s, position in mm.
    pub path: (Vec<f64>, Vec<f64>),
    /// Mean velocity over the second half, um/s.
    pub velocity_um_s: f64,
}

pub(super) fn drift(truth: &AxisParameters, parameters: &Parameters) -> Drift {
    let sliding = &parameters.friction.sliding;
    let level_v = sliding
        .positive
        .curve
        .coulomb_v
        .min(sliding.negative.curve.coulomb_v);
    let mut axis = SimulatedAxis::new(truth.clone(), RATE_HZ, 0);
    let period = (RATE_HZ / FREQUENCY_HZ).round() as usize;
    let periods = (DURATION_S * FREQUENCY_HZ).round() as usize;
    let path: (Vec<f64>, Vec<f64>) = (0..periods)
        .map(|index| {
            let mut sum = 0.0;
            for tick in index * period..(index + 1) * period {
                let time_s = tick as f64 / RATE_HZ;
                let load = MEAN + AMPLITUDE * (TAU * FREQUENCY_HZ * time_s).sin();
                axis.set_load_v(level_v * load * (time_s / RISE_S).min(1.0));
                axis.step(DacCode::ZERO, false);
                sum += axis.position_mm();
            }
            let time_s = (index as f64 + 0.5) / FREQUENCY_HZ;
            (time_s, sum / period as f64)
        })
        .unzip();
    let (first, last) = (periods / 2, periods - 1);
    let velocity = (path.1[last] - path.1[first]) / (path.0[last] - path.0[first]);
    Drift {
        path,
        velocity_um_s: 1e3 * velocity,
    }
}
