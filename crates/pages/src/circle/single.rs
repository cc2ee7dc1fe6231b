//! The one circle of the comparison: XY, counter-clockwise, every configuration.

use quadrant_law::reference::{Plane, Sense};
use rayon::prelude::*;

use crate::circle::turn::{CircleRefusal, NominalCircle, run_turn};
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::RunConfiguration;

/// Radius, mm.
pub const RADIUS_MM: f64 = 30.0;
/// Feed along the path, mm/s.
pub const FEED_MM_S: f64 = 15.0;

/// One turn of a circle.
#[derive(Clone, Debug)]
pub struct CircleOutcome {
    pub configuration: Configuration,
    /// Angle of the true path, rad, and its deviation from the radius, mm.
    pub path: Vec<(f64, f64)>,
    /// Circular deviation G, mm.
    pub circular_deviation_mm: f64,
    /// Mean radial height of the spikes at the four reversals, mm.
    pub reversal_spike_mm: f64,
}

/// Runs the circle with each configuration, in parallel.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_circles(
    configurations: &[Configuration],
    setup: &RunConfiguration,
    seed: u64,
) -> Result<Vec<CircleOutcome>, CircleRefusal> {
    let nominal = NominalCircle {
        plane: Plane::Xy,
        sense: Sense::CounterClockwise,
        radius_mm: RADIUS_MM,
        feed_mm_s: FEED_MM_S,
    };
    configurations
        .par_iter()
        .map(|&configuration| {
            let turn = run_turn(nominal, configuration, setup, seed)?;
            Ok(CircleOutcome {
                configuration,
                path: turn.path,
                circular_deviation_mm: turn.circular_deviation_mm,
                reversal_spike_mm: turn.spikes.mean_height_mm(),
            })
        })
        .collect()
}
