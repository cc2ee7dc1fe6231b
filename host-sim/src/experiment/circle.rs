//! The circle test in the XY plane, as a ball-bar would draw it (ISO 230-4).

use quadrant::link::lockstep::Job;
use quadrant::reference::{Plane, Sense, circle};
use quadrant::scalar::Scalar;
use quadrant::settings::PlanSettings;
use rayon::prelude::*;

use super::comparison::{Configuration, ELEMENTS};
use super::compensator::Setup;
use super::metrics::glitch_at;
use super::run::{AxisTrace, RunError, run};
use crate::machine::Machine;
use crate::plant::SimulatedStage;

/// Radius, mm.
pub const RADIUS_MM: f64 = 30.0;
/// Feed along the path, mm/s.
pub const FEED_MM_S: f64 = 15.0;
/// Angle at which the full-speed turns begin, rad: between two reversals.
const START_RAD: f64 = std::f64::consts::FRAC_PI_4;
/// Turns at full speed, the last of which counts.
const TURNS: f64 = 1.5;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// One turn of a circle.
#[derive(Clone, Debug)]
pub struct CircleOutcome {
    /// Who ran.
    pub configuration: Configuration,
    /// Angle of the reference, rad, and deviation of the true path from the radius, mm.
    pub path: Vec<(f64, f64)>,
    /// Circular deviation G: largest minus smallest radial deviation, mm.
    pub circular_deviation_mm: f64,
    /// Mean radial height of the spikes at the four reversals, mm.
    pub reversal_spike_mm: f64,
}

/// Half the window around a reversal in which its spike is looked for, as a fraction of the turn.
const SPIKE_WINDOW: f64 = 0.02;

/// Turns the last turn of two traces into a path around the circle's centre.
fn outcome(configuration: Configuration, x: &AxisTrace, y: &AxisTrace) -> CircleOutcome {
    let centre = |trace: &AxisTrace| {
        let high = trace.reference_mm.iter().copied().fold(f64::MIN, f64::max);
        let low = trace.reference_mm.iter().copied().fold(f64::MAX, f64::min);
        0.5 * (high + low)
    };
    let (centre_x, centre_y) = (centre(x), centre(y));
    let path: Vec<(f64, f64)> = (0..x.reference_mm.len())
        .map(|k| {
            let (rx, ry) = (x.reference_mm[k] - centre_x, y.reference_mm[k] - centre_y);
            let deviation = (rx - x.error_mm[k]).hypot(ry - y.error_mm[k]) - RADIUS_MM;
            (ry.atan2(rx), deviation)
        })
        .collect();
    let deviations: Vec<f64> = path.iter().map(|&(_, deviation)| deviation).collect();
    let high = deviations.iter().copied().fold(f64::MIN, f64::max);
    let low = deviations.iter().copied().fold(f64::MAX, f64::min);
    let turn = deviations.len();
    let window = (turn as f64 * SPIKE_WINDOW) as usize;
    // The turn starts halfway between two reversals.
    let spikes: Vec<f64> = (0..4)
        .filter_map(|quadrant| glitch_at(&deviations, turn / 8 + quadrant * turn / 4, window))
        .collect();
    CircleOutcome {
        configuration,
        path,
        circular_deviation_mm: high - low,
        reversal_spike_mm: spikes.iter().sum::<f64>() / spikes.len() as f64,
    }
}

/// Runs the circle with each configuration, in parallel.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_circles<S: Scalar>(
    configurations: &[Configuration],
    setup: &Setup,
    seed: u64,
) -> Result<Vec<CircleOutcome>, RunError> {
    configurations
        .par_iter()
        .map(|&configuration| {
            let mut stage = setup.stage.clone();
            configuration.apply(&mut stage);
            let rate_hz = stage.rate_hz;
            let job = Job {
                stage,
                plan: PlanSettings {
                    motions: circle(
                        Plane::Xy,
                        Sense::CounterClockwise,
                        RADIUS_MM,
                        FEED_MM_S,
                        START_RAD,
                        TURNS,
                        LEAD_S,
                    ),
                },
            };
            let turn_s = std::f64::consts::TAU * RADIUS_MM / FEED_MM_S;
            let longest_s = 2.0 + 2.0 * LEAD_S + TURNS * turn_s;
            let resolution_mm = job
                .stage
                .axes
                .each_ref()
                .map(|axis| axis.encoder.resolution_mm);
            let mut machine = Machine::<S, ELEMENTS>::new(&job)?;
            let mut plant = SimulatedStage::new(&setup.truth, rate_hz, seed);
            let [x, y, _] = run(
                &mut machine,
                &mut plant,
                resolution_mm,
                (longest_s * rate_hz) as usize,
            )?;
            let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
            // The last whole turn that begins where the full-speed turns began: halfway between two reversals.
            let begin = samples(LEAD_S) + samples((TURNS - 1.0).floor() * turn_s);
            let last_turn = begin..begin + samples(turn_s);
            Ok(outcome(
                configuration,
                &x.slice(last_turn.clone()),
                &y.slice(last_turn),
            ))
        })
        .collect()
}
