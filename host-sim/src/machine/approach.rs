//! Moving a test_axis's axis to a position between experiments.

use quadrant::reference::{MotionSettings, PointToPointSettings};

use super::test_axis::{Drive, Experiment, ExperimentError, TestAxis};

/// Limits of the move: unhurried.
const VELOCITY_MM_S: f64 = 30.0;
const ACCELERATION_MM_S2: f64 = 300.0;
const JERK_MM_S3: f64 = 5e3;
/// Distance that is not worth a move, mm.
const NEAR_MM: f64 = 0.05;
/// Time for which the position is read, s.
const LOOK_S: f64 = 0.01;

/// Moves the axis to `target_mm`, under the settings that are in force.
///
/// # Errors
/// A move that is stopped.
pub fn approach(test_axis: &mut dyn TestAxis, target_mm: f64) -> Result<(), ExperimentError> {
    let rate_hz = test_axis.info().rate_hz;
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
        return Ok(());
    }
    test_axis.perform(
        &Experiment {
            name: format!("moving to {target_mm:.1} mm"),
            drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s: VELOCITY_MM_S,
                max_acceleration_mm_s2: ACCELERATION_MM_S2,
                max_jerk_mm_s3: JERK_MM_S3,
            })),
            injection_v: Vec::new(),
            decimation: 100,
            time_limit_s: 10.0 + 2.0 * distance_mm.abs() / VELOCITY_MM_S,
        },
        &mut |_| {},
    )?;
    Ok(())
}
