//! A part program on the simulated stage: the firmware's law follows it, and the true path is compared with the
//! programmed one.

use quadrant_gcode::{Place, Trajectory, Vector};
use quadrant_law::reference::{Motion, RecordedTable};
use quadrant_law::units::Position;
use quadrant_settings::StageSettings;
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::metrics::{largest, rms};
use quadrant_sim::plant::SimulatedStage;
use quadrant_sim::run::{AxisTrace, ELEMENTS, RunError, run};
use rayon::prelude::*;

use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::RunConfiguration;

/// The program's motion, sampled at the control rate.
#[derive(Clone, Debug)]
pub struct ProgramTables {
    /// Position on the path at every control period.
    pub places: Vec<Place>,
    /// The references of x, y and z at the same times, mm, from the program's origin.
    pub reference_mm: [Vec<f64>; 3],
    /// Control period, s.
    pub period_s: f64,
    positions: [&'static [Position]; 3],
}

/// Hold after the last move, s: the axes come to rest, and the reference's preview runs out.
const HOLD_S: f64 = 0.1;

impl ProgramTables {
    /// Samples a trajectory at the stage's control rate, in the units of its encoders. The tables live as long as the
    /// process, as the firmware's live in flash.
    pub fn sample(trajectory: &Trajectory, stage: &StageSettings) -> Self {
        let mut places: Vec<Place> = trajectory.places(stage.rate_hz).collect();
        if let Some(&last) = places.last() {
            let hold = (HOLD_S * stage.rate_hz).round() as usize;
            places.resize(places.len() + hold, last);
        }
        let points: Vec<Vector> = places.iter().map(|place| trajectory.point(place)).collect();
        let reference_mm: [Vec<f64>; 3] =
            std::array::from_fn(|axis| points.iter().map(|point| point[axis]).collect());
        let positions = std::array::from_fn(|axis| {
            let resolution_mm = stage.axes[axis].encoder.resolution_mm;
            let table: Vec<Position> = reference_mm[axis]
                .iter()
                .map(|&mm| Position::from_mm(mm, resolution_mm))
                .collect();
            &*table.leak()
        });
        Self {
            places,
            reference_mm,
            period_s: 1.0 / stage.rate_hz,
            positions,
        }
    }
}

/// Result of one configuration on a program.
#[derive(Clone, Debug)]
pub struct ProgramOutcome {
    pub configuration: Configuration,
    /// Largest distance of the true path from the programmed one, mm.
    pub contour_largest_mm: f64,
    /// RMS of that distance, mm.
    pub contour_rms_mm: f64,
    /// Largest and RMS tracking error of x, y and z, mm.
    pub axes_mm: [(f64, f64); 3],
    /// The true position at every control period, mm, as the references are counted.
    pub position_mm: [Vec<f64>; 3],
    /// Tracking errors, mm: what the feedback follows, which is late by the preview, less the true position.
    pub error_mm: [Vec<f64>; 3],
    /// From the path's nearest point to the true position, at every control period, mm.
    pub deviation_mm: Vec<[f64; 3]>,
}

/// Runs configurations on a sampled program, in parallel; the same seed gives the same outcomes. `advance` is called after
/// each configuration.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_program(
    trajectory: &Trajectory,
    tables: &ProgramTables,
    configurations: &[Configuration],
    setup: &RunConfiguration,
    seed: u64,
    advance: &(dyn Fn() + Sync),
) -> Result<Vec<ProgramOutcome>, RunError> {
    configurations
        .par_iter()
        .map(|&configuration| {
            let outcome = run_one(trajectory, tables, configuration, setup, seed);
            advance();
            outcome
        })
        .collect()
}

fn run_one(
    trajectory: &Trajectory,
    tables: &ProgramTables,
    configuration: Configuration,
    setup: &RunConfiguration,
    seed: u64,
) -> Result<ProgramOutcome, RunError> {
    let stage = setup.stage_of(configuration);
    let motions = std::array::from_fn(|axis| {
        Motion::Recorded(RecordedTable::new(
            tables.positions[axis],
            1,
            stage.motion_scale(axis),
        ))
    });
    let resolution_mm = stage.axes.each_ref().map(|axis| axis.encoder.resolution_mm);
    let mut machine = LawMachine::<f32, ELEMENTS>::with_plan(stage.build()?, motions);
    let mut plant = SimulatedStage::new(&setup.truth, stage.rate_hz, seed);
    let most_ticks = tables.places.len() + 10_000;
    let traces = run(&mut machine, &mut plant, resolution_mm, most_ticks)?;
    // The tables are relative to where the axes stood when the motion began.
    let origin: [f64; 3] = std::array::from_fn(|axis| {
        let trace = &traces[axis];
        trace.reference_mm.first().copied().unwrap_or_default() - tables.reference_mm[axis][0]
    });
    // What the feedback follows is late by the preview.
    let late = stage
        .axes
        .each_ref()
        .map(|axis| (axis.feedforward.preview_s * stage.rate_hz).round() as usize);
    let position_mm: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let AxisTrace {
            reference_mm,
            error_mm,
            ..
        } = &traces[axis];
        let pairs = reference_mm.iter().zip(error_mm);
        pairs
            .map(|(reference, error)| reference - error - origin[axis])
            .collect()
    });
    let mean_late = late.iter().sum::<usize>() / late.len();
    let deviation_mm: Vec<[f64; 3]> = (0..position_mm[0].len())
        .map(|tick| {
            let place = &tables.places[tick.saturating_sub(mean_late).min(tables.places.len() - 1)];
            let point = Vector::from_fn(|axis, _| position_mm[axis][tick]);
            trajectory.deviation(place, &point).into()
        })
        .collect();
    let contour: Vec<f64> = deviation_mm
        .iter()
        .map(|deviation| Vector::from(*deviation).norm())
        .collect();
    let error_mm = traces.map(|trace| trace.error_mm);
    Ok(ProgramOutcome {
        configuration,
        contour_largest_mm: largest(&contour),
        contour_rms_mm: rms(&contour),
        axes_mm: error_mm
            .each_ref()
            .map(|error| (largest(error), rms(error))),
        position_mm,
        error_mm,
        deviation_mm,
    })
}
