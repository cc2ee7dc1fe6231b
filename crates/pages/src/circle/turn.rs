//! One circle in one sense: its run, and the turn that counts.

use std::f64::consts::TAU;

use quadrant_law::reference::{Plane, Sense, circle};
use quadrant_report::decimate;
use quadrant_settings::Job;
use quadrant_settings::PlanSettings;
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::plant::SimulatedStage;
use quadrant_sim::run::{ELEMENTS, RunError, run};

use crate::circle::path::Point;
use crate::circle::roundness::{LeastSquares, range};
use crate::circle::spikes::Spikes;
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::RunConfiguration;

/// Angle at which the full-speed turns begin, rad: between two reversals.
const START_RAD: f64 = TAU / 8.0;
/// Turns at full speed before the turn that counts, and after it.
const RUN_IN_TURNS: f64 = 0.5;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;
/// Longest turn that is simulated, s: as slow as 0.5 mm/s around the default's largest radius.
const MOST_TURN_S: f64 = 630.0;
/// Points of a path that are kept for drawing.
const DRAWN_POINTS: usize = 4000;

/// A circle as it is programmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalCircle {
    /// The plane of its two axes.
    pub plane: Plane,
    pub sense: Sense,
    /// Radius, mm; above zero.
    pub radius_mm: f64,
    /// Feed along the path, mm/s; above zero.
    pub feed_mm_s: f64,
}

/// Reasons for which a circle was not run to its end.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CircleRefusal {
    /// It would take too long.
    #[error(
        "one turn takes {turn_s:.0} s, more than {MOST_TURN_S} s; choose a higher feed or a smaller radius"
    )]
    TooSlow {
        /// Its duration, s.
        turn_s: f64,
    },
    /// An axis' limits do not allow it.
    #[error("{0}; choose a lower feed or a larger radius")]
    Limits(quadrant_settings::SettingsError),
    /// The settings are refused, or the stage switched off.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Result of one turn; mm.
#[derive(Clone, Debug)]
pub struct Turn {
    pub circular_deviation_mm: f64,
    /// Largest radial deviation, Fmax.
    pub radial_max_mm: f64,
    /// Smallest radial deviation, Fmin.
    pub radial_min_mm: f64,
    /// The spikes at the four reversals.
    pub spikes: Spikes,
    /// Angle, rad, and radial deviation, mm, thinned for drawing; extremes are kept.
    pub path: Vec<(f64, f64)>,
}

/// Runs a circle and returns the true path over the turn that counts, a point a control period.
///
/// # Errors
/// A circle beyond the axes' limits, refused settings, or a fault.
pub fn run_path(
    nominal: NominalCircle,
    configuration: Configuration,
    setup: &RunConfiguration,
    seed: u64,
) -> Result<Vec<Point>, CircleRefusal> {
    let turn_s = TAU * nominal.radius_mm / nominal.feed_mm_s;
    if turn_s.is_nan() || turn_s > MOST_TURN_S {
        return Err(CircleRefusal::TooSlow { turn_s });
    }
    let stage = setup.stage_of(configuration);
    let rate_hz = stage.rate_hz;
    let turns = 1.0 + 2.0 * RUN_IN_TURNS;
    let job = Job {
        stage,
        plan: PlanSettings {
            motions: circle(
                nominal.plane,
                nominal.sense,
                nominal.radius_mm,
                nominal.feed_mm_s,
                START_RAD,
                turns,
                LEAD_S,
            ),
        },
    };
    job.plan
        .validate(&job.stage)
        .map_err(CircleRefusal::Limits)?;
    let axes = &job.stage.axes;
    let resolution_mm = axes.each_ref().map(|axis| axis.encoder.resolution_mm);
    // The reference that the feedback sees is late by the preview.
    let preview_s = axes
        .iter()
        .fold(0.0_f64, |most, axis| most.max(axis.feedforward.preview_s));
    let mut machine = LawMachine::<f32, ELEMENTS>::new(&job).map_err(RunError::from)?;
    let mut plant = SimulatedStage::new(&setup.truth, rate_hz, seed);
    let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
    let most_ticks = samples(2.0 + 2.0 * LEAD_S + turns * turn_s);
    let traces = run(&mut machine, &mut plant, resolution_mm, most_ticks)?;
    let begin = samples(LEAD_S + preview_s + RUN_IN_TURNS * turn_s);
    let counted = begin..begin + samples(turn_s);
    let (first, second) = nominal.plane.axes();
    let [first, second] = [first, second].map(|axis| {
        let trace = traces[axis].slice(counted.clone());
        let (high, low) = range(trace.reference_mm.iter().copied());
        let centre = 0.5 * (high + low);
        let true_mm = trace.reference_mm.iter().zip(&trace.error_mm);
        true_mm
            .map(|(reference, error)| reference - error - centre)
            .collect::<Vec<_>>()
    });
    Ok(first.into_iter().zip(second).map(Point::from).collect())
}

impl Turn {
    /// Evaluates a path of one turn that begins halfway between two reversals, `rate_hz` points a second.
    pub fn evaluate(nominal: NominalCircle, path: &[Point], rate_hz: f64) -> Self {
        let radial = |&[first, second]: &Point| first.hypot(second) - nominal.radius_mm;
        let deviations: Vec<f64> = path.iter().map(radial).collect();
        let (radial_max_mm, radial_min_mm) = range(deviations.iter().copied());
        let circle = LeastSquares::fit([path]);
        let (high, low) = range(path.iter().map(|point| circle.radius_at(point)));
        let angles: Vec<f64> = path
            .iter()
            .map(|&[first, second]| second.atan2(first))
            .collect();
        Self {
            circular_deviation_mm: high - low,
            radial_max_mm,
            radial_min_mm,
            spikes: Spikes::find(&deviations, nominal.sense, rate_hz),
            path: decimate(&angles, &deviations, DRAWN_POINTS)
                .into_iter()
                .map(|index| (angles[index], deviations[index]))
                .collect(),
        }
    }
}

/// Runs a circle and evaluates it.
///
/// # Errors
/// Those of [`run_path`].
pub fn run_turn(
    nominal: NominalCircle,
    configuration: Configuration,
    setup: &RunConfiguration,
    seed: u64,
) -> Result<Turn, CircleRefusal> {
    let path = run_path(nominal, configuration, setup, seed)?;
    Ok(Turn::evaluate(nominal, &path, setup.stage.rate_hz))
}
