//! Moving an axis under test to a position between experiments.

use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_law::safety::FaultCode;

use super::axis::{AxisInfo, Drive, Experiment, ExperimentError, TestAxis};
use crate::record::Recording;

/// Velocity of the move, mm/s: slow.
const VELOCITY_MM_S: f64 = 30.0;
/// Acceleration of the move, mm/s^2.
const ACCELERATION_MM_S2: f64 = 300.0;
/// Jerk of the move, mm/s^3.
const JERK_MM_S3: f64 = 5e3;
/// Share of the largest velocity that it takes at most.
const MOST_VELOCITY: f64 = 0.5;
/// Time in which it goes through the travel either way at least, s: on a short one a soft controller has no way to lag by.
const TRAVEL_S: f64 = 2.0;
/// Largest number of moves.
const MAX_MOVES: usize = 4;
/// Distance over the travel within which the axis counts as there; otherwise a further move follows.
const MAX_DISTANCE_SHARE: f64 = 0.02;
/// Distance that is not worth a move, mm.
const NEAR_MM: f64 = 0.05;
/// Velocities of a move over the usual one: a soft controller, held by friction, lags by less where its integral has more time.
const SLOWER: [f64; 3] = [1.0, 0.25, 0.0625];
/// Error against the sense of the move over the one in it, from which on a move was not stopped because the axis lagged.
const MOST_LEAD: f64 = 0.25;
/// Time for which the position is read, s.
const LOOK_S: f64 = 0.01;

/// Moves the axis to `target_mm`, under the settings that are in force.
///
/// # Errors
/// A move that is stopped.
pub fn approach(test_axis: &mut dyn TestAxis, target_mm: f64) -> Result<(), ExperimentError> {
    approach_within(test_axis, target_mm, f64::INFINITY)
}

/// The same, to within a distance, mm, where it can be, and what counts as there.
fn approach_within(
    test_axis: &mut dyn TestAxis,
    target_mm: f64,
    within_mm: f64,
) -> Result<(), ExperimentError> {
    let near_mm = NEAR_MM.max(within_mm.min(MAX_DISTANCE_SHARE * test_axis.info().travel_mm));
    for _ in 1..MAX_MOVES {
        if approach_once(test_axis, target_mm)? < near_mm {
            return Ok(());
        }
    }
    approach_once(test_axis, target_mm)?;
    Ok(())
}

/// As [`approach`], if there is no last recording or it ended more than `astray_mm` away from the target: an axis that lags more one
/// way than the other wanders off from run to run.
///
/// # Errors
/// A move that is stopped.
pub fn approach_from(
    test_axis: &mut dyn TestAxis,
    last: Option<&Recording>,
    target_mm: f64,
    astray_mm: f64,
) -> Result<(), ExperimentError> {
    match last.and_then(|recording| recording.position_mm.last()) {
        Some(at_mm) if (at_mm - target_mm).abs() <= astray_mm => Ok(()),
        _ => approach_within(test_axis, target_mm, astray_mm),
    }
}

/// Velocity of a move, mm/s.
pub fn approach_mm_s(info: &AxisInfo) -> f64 {
    VELOCITY_MM_S
        .min(MOST_VELOCITY * info.max_velocity_mm_s)
        .min(info.travel_mm / TRAVEL_S)
}

/// One move towards the target, slower where the axis lagged too far behind a faster one; the distance that is left, mm.
fn approach_once(test_axis: &mut dyn TestAxis, target_mm: f64) -> Result<f64, ExperimentError> {
    let mut outcome = Ok(0.0);
    for slower in SLOWER {
        let velocity_mm_s = slower * approach_mm_s(&test_axis.info());
        outcome = move_to(test_axis, target_mm, velocity_mm_s);
        let lags = matches!(
            &outcome,
            Err(ExperimentError::Fault { fault, .. }) if fault.code == FaultCode::FollowingError
        );
        if !(lags && test_axis.interrupted().is_some_and(only_lagged)) {
            break;
        }
    }
    outcome
}

/// True if a recording's axis was behind its reference, and did not swing about it.
fn only_lagged(recording: &Recording) -> bool {
    let errors = recording.reference_mm.iter().zip(&recording.position_mm);
    let (least, most) = errors
        .map(|(reference, position)| reference - position)
        .fold((0.0_f64, 0.0_f64), |(least, most), error| {
            (least.min(error), most.max(error))
        });
    let (ahead, behind) = if most > -least {
        (-least, most)
    } else {
        (most, -least)
    };
    ahead < MOST_LEAD * behind
}

/// A move towards the target at a velocity, mm/s; the distance that is left, mm.
fn move_to(
    test_axis: &mut dyn TestAxis,
    target_mm: f64,
    velocity_mm_s: f64,
) -> Result<f64, ExperimentError> {
    let info = test_axis.info();
    let rate_hz = info.rate_hz;
    let look = Experiment {
        name: "reading the position".to_owned(),
        drive: Drive::ClosedLoop(MotionSettings::Hold),
        injection_v: vec![0.0; (LOOK_S * rate_hz).ceil() as usize],
        decimation: 1,
        time_limit_s: 10.0,
    };
    let recording = test_axis.perform(&look, &mut |_| {})?;
    let position_mm = recording.position_mm.last().copied().unwrap_or(target_mm);
    let distance_mm = target_mm - position_mm;
    if distance_mm.abs() < NEAR_MM {
        return Ok(0.0);
    }
    let recording = test_axis.perform(
        &Experiment {
            name: format!("moving to {target_mm:.1} mm"),
            drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s: velocity_mm_s,
                max_acceleration_mm_s2: ACCELERATION_MM_S2.min(info.max_acceleration_mm_s2),
                max_jerk_mm_s3: JERK_MM_S3,
            })),
            injection_v: Vec::new(),
            decimation: 100,
            time_limit_s: 10.0 + 2.0 * distance_mm.abs() / velocity_mm_s,
        },
        &mut |_| {},
    )?;
    let reached_mm = recording.position_mm.last();
    Ok(reached_mm.map_or(0.0, |reached_mm| (target_mm - reached_mm).abs()))
}
